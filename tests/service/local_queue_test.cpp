// Jobs as processes of this machine: how they end, and that none is left behind.
#include "tools/service/work/local_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "config/text_tree.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"

namespace postchain::service {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class Local : public testing::Test {
  protected:
    static bool wait_for(const std::function<bool()>& what) {
        for (int i = 0; i < 12'000; ++i, std::this_thread::sleep_for(5ms))
            if (what()) return true;
        return false;
    }
    // Each task is a script of sh.
    TaskArray array(const std::vector<std::string>& scripts) const {
        TaskArray array;
        array.name = "a";
        array.folder = folder_.path();
        array.command = {"sh", "-c"};
        for (const std::string& script : scripts) array.tasks.push_back({script});
        array.log_folder = folder_.path();
        return array;
    }
    ArrayState look() { return test::must(queue_.look({{"a", "a"}}))["a"]; }
    ArrayState ended() {
        ArrayState state;
        EXPECT_TRUE(wait_for([&] { return (state = look()).ended(); }));
        return state;
    }
    ArrayState ran(const TaskArray& array) {
        EXPECT_EQ(test::must(queue_.submit(array)), "a");
        return ended();
    }
    std::string text(const std::string& name) const {
        const auto read = read_text_file(folder_.path(name), StatusCode::input);
        return read.ok() ? *read : std::string();
    }
    // The id of a process that writes it to the file "pid".
    pid_t pid() const {
        EXPECT_TRUE(wait_for([&] { return text("pid").ends_with("\n"); }));
        return std::atoi(text("pid").c_str());
    }
    // Or is a zombie: nobody else may wait for an orphan.
    static bool is_gone(pid_t process) {
        return wait_for([&] {
            std::ifstream file(concat("/proc/", process, "/stat"));
            std::string id, name, state;
            return !(file >> id >> name >> state) || state == "Z";
        });
    }

    test::TempFolder folder_;
    LocalQueue queue_{{.memory = uint64_t(64) << 20, .grace = 300ms}};
};

TEST_F(Local, TasksRunInOrderAndTheirEndsAreNamed) {
    const ArrayState state =
        ran(array({"echo one; echo said >&2; echo 1 >file", "exit 3", "cat file; pwd"}));
    EXPECT_EQ(state.done, 2);
    EXPECT_EQ(state.failed, 1);
    EXPECT_EQ(text("1.events"), "one\n");
    EXPECT_EQ(text("1.log"), "said\n");
    EXPECT_EQ(text("1.exit") + text("2.exit"), "0\n3\n");
    EXPECT_THAT(text("3.events"), testing::MatchesRegex("1\n/.*\n")) << "in their folder";
}

TEST_F(Local, ATaskThatFailsSaysHow) {
    EXPECT_EQ(ran(array({"exit 3"})).message, "its process ended with exit code 3");
    const ArrayState killed = ran(array({"true", "kill -SEGV $$", "true"}));
    EXPECT_EQ(killed.message, "its process was ended by SIGSEGV");
    EXPECT_EQ(killed.failed_task, 2);
    EXPECT_EQ(killed.done, 2) << "the others run all the same";
    EXPECT_EQ(text("2.exit"), "139\n");
    TaskArray none = array({"true"});
    none.command = {"no-such-program"};
    EXPECT_THAT(test::error_of(queue_.submit(none)), HasSubstr("no-such-program"));
}

TEST_F(Local, ACanceledTaskMayEndItsFrameAndNoMore) {
    const std::string goes_on = " TERM; echo $$ >pid; while :; do sleep 0.01; done";
    test::must(queue_.submit(array({"trap 'echo whole; exit 0'" + goes_on, "echo next"})));
    (void)pid();
    ASSERT_TRUE(queue_.cancel("a").ok());
    EXPECT_EQ(ended().done, 1);
    EXPECT_EQ(text("1.events"), "whole\n");
    EXPECT_EQ(text("2.events"), "") << "it does not begin";
    std::filesystem::remove(folder_.path("pid"));
    test::must(queue_.submit(array({"trap ''" + goes_on})));
    const pid_t deaf = pid();
    const auto start = std::chrono::steady_clock::now();
    ASSERT_TRUE(queue_.cancel("a").ok());
    EXPECT_EQ(ended().message, "its process was ended by SIGKILL");
    EXPECT_GE(std::chrono::steady_clock::now() - start, 300ms);
    EXPECT_TRUE(is_gone(deaf));
}

TEST_F(Local, ATaskThatPrintsNothingIsKilled) {
    TaskArray silent = array({"sleep 1000"});
    silent.silence_s = 0.5;
    EXPECT_THAT(ran(silent).message, HasSubstr("was read, filtered or written for 0.5 s"));
    TaskArray prints = array({"for i in 1 2 3 4 5 6 7 8; do echo $i >&2; sleep 0.2; done"});
    prints.silence_s = 1;
    EXPECT_EQ(ran(prints).done, 1);
}

TEST_F(Local, ATaskHasItsMemoryAndNoMore) {
    const std::string python = "exec python3 -c 'a = bytearray(";
    EXPECT_EQ(ran(array({python + "1 << 20)'"})).done, 1);
    EXPECT_EQ(ran(array({python + "1 << 30)'"})).message, "its process ended with exit code 1");
    EXPECT_THAT(text("1.log"), HasSubstr("MemoryError"));
}

TEST_F(Local, AnArrayThatNobodyAsksForIsKilled) {
    test::must(queue_.submit(array({"sleep 1000 & echo $! >pid; wait"})));
    const pid_t of_its_group = pid();
    EXPECT_EQ(look().running, 1);
    EXPECT_TRUE(test::must(queue_.look({})).empty());
    EXPECT_TRUE(is_gone(of_its_group));
}

// Also if that is killed.
TEST_F(Local, TasksDieWithTheProcessOfTheQueue) {
    const pid_t service = ::fork();
    if (service == 0) {
        LocalQueue queue{LocalSettings()};
        (void)queue.submit(array({"echo $$ >pid; exec sleep 1000"}));
        ::pause();
        ::_exit(0);
    }
    const pid_t task = pid();
    EXPECT_EQ(::kill(task, 0), 0);
    ::kill(service, SIGKILL);
    ::waitpid(service, nullptr, 0);
    EXPECT_TRUE(is_gone(task));
}

}  // namespace
}  // namespace postchain::service
