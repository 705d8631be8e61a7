// Reads the output of Slurm's programs; and programs that fail or hang.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tools/service/work/run_program.h"
#include "tools/service/work/slurm_queue.h"

namespace postchain::service {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

TEST(Slurm, StatesOfTasks) {
    // Lines of squeue 22.05: waiting tasks are grouped. Another job has no array.
    std::map<std::string, RemoteTasks> jobs{{"a", {}}, {"b", {}}, {"gone", {}}};
    add_tasks_of_squeue(
        "12|3,5-40%4|PENDING|a\n12|1|COMPLETED|a\n12|2|RUNNING|a\n12|4|NODE_FAIL|a\n"
        "16|N/A|RUNNING|other\n17|1|RUNNING|b\n",
        jobs);
    const RemoteTasks& tasks = jobs["a"];
    EXPECT_EQ(tasks.id, "12");
    EXPECT_EQ(tasks.waiting, 37);
    EXPECT_EQ(tasks.running, 1);
    EXPECT_EQ(tasks.done, 1);
    EXPECT_EQ(tasks.failed, 1);
    EXPECT_EQ(tasks.failed_task, 4);
    EXPECT_EQ(tasks.message, "task 4: NODE_FAIL");
    EXPECT_FALSE(tasks.ended());
    EXPECT_EQ(jobs["b"].id, "17");
    EXPECT_FALSE(jobs["gone"].known());
    EXPECT_EQ(jobs.size(), 3u);
    std::map<std::string, RemoteTasks> ended{{"a", {}}};
    add_tasks_of_sacct(
        "12_1|COMPLETED|a\n12_2|CANCELLED by 1000|a\n12_[5-6]|COMPLETED|a\n12_4|OUT_OF_MEMORY|a\n"
        "12_7|FAILED|a job that had this id before\n",
        ended);
    EXPECT_TRUE(ended["a"].ended());
    EXPECT_EQ(ended["a"].done, 3);
    EXPECT_EQ(ended["a"].failed, 2);
}

// The script, as a task runs it.
ProgramResult ran_as_task(const RemoteJob& job, const std::string& version, int task) {
    const auto ran =
        run_program({"env", concat("SLURM_ARRAY_TASK_ID=", task), "SLURM_CPUS_PER_TASK=3", "sh"},
                    script_of(job, version), std::chrono::seconds(60));
    EXPECT_TRUE(ran.ok()) << ran.status().message();
    return ran.ok() ? *ran : ProgramResult();
}

TEST(Slurm, AScriptRunsTheWordsOfItsTaskAndNoOtherVersion) {
    RemoteJob job;
    job.command = {"echo", "a 'b' $c", "*"};
    job.tasks = {{"--frames=1"}, {}, {"--frames=3 4"}};
    EXPECT_EQ(ran_as_task(job, "", 1).out, "a 'b' $c * --frames=1 --threads=3\n");
    EXPECT_EQ(ran_as_task(job, "", 2).out, "a 'b' $c * --threads=3\n");
    EXPECT_EQ(ran_as_task(job, "", 3).out, "a 'b' $c * --frames=3 4 --threads=3\n");
    const ProgramResult other = ran_as_task(job, "1.2", 1);
    EXPECT_EQ(other.exit_code, 2);
    EXPECT_EQ(other.out, "");
    EXPECT_THAT(other.err, HasSubstr("the service is postchain 1.2"));
    // Larger than an argument may be, which has 128 KiB.
    job.tasks.assign(300, {"--frames=" + std::string(1000, '1')});
    EXPECT_THAT(ran_as_task(job, "", 300).out, HasSubstr(" --threads=3\n"));
}

TEST(Programs, AreRunAndQuoted) {
    const auto ran = run_program({"sh", "-c", "cat; echo wrong >&2; exit 3"}, "text", 60s);
    ASSERT_TRUE(ran.ok()) << ran.status().message();
    EXPECT_EQ(ran->exit_code, 3);
    EXPECT_EQ(ran->out, "text");
    EXPECT_EQ(ran->err, "wrong\n");
    EXPECT_THAT(run_program({"no-such-program"}, "", 60s).status().message(), HasSubstr("PATH"));
    const std::string odd = "a 'b' $c \"d\" \\";
    EXPECT_EQ(run_program({"sh", "-c", "printf %s " + shell_quoted(odd)}, "", 60s)->out, odd);
}

// None of these waits for a program that sleeps 1000 s.
TEST(Programs, AreNotWaitedFor) {
    const auto start = std::chrono::steady_clock::now();
    const std::string much(1 << 20, 'x');  // a pipe holds 64 KiB
    for (const char* script : {"sleep 1000", "exec >&- 2>&-; sleep 1000"})
        EXPECT_THAT(run_program({"sh", "-c", script}, much, 300ms).status().message(),
                    HasSubstr("did not answer within 0.3 s"))
            << script;
    EXPECT_EQ(run_program({"wc", "-c"}, much, 60s)->out, "1048576\n");
    EXPECT_EQ(run_program({"true"}, much, 60s)->exit_code, 0);
    // A program that leaves another one with its streams.
    EXPECT_EQ(run_program({"sh", "-c", "sleep 1000 & echo done"}, "", 60s)->out, "done\n");
    // The service ends.
    std::atomic<bool> stop = false;
    std::thread signal([&] {
        std::this_thread::sleep_for(100ms);
        stop = true;
    });
    EXPECT_THAT(run_program({"sleep", "1000"}, "", 600s, &stop).status().message(),
                HasSubstr("was ended with the service"));
    signal.join();
    EXPECT_LT(std::chrono::steady_clock::now() - start, 30s);
}

TEST(Programs, InheritNoSocket) {
    const int opened = ::socket(AF_INET, SOCK_STREAM, 0);  // without SOCK_CLOEXEC
    const int listens = ::fcntl(opened, F_DUPFD, 100);
    ASSERT_GE(listens, 100);
    const auto ran = run_program({"sh", "-c", "ls -l /proc/$$/fd"}, "", 60s);
    ::close(listens);
    ::close(opened);
    EXPECT_THAT(ran->out, HasSubstr(" 2 -> ")) << ran->out;
    EXPECT_THAT(ran->out, testing::Not(HasSubstr("socket:"))) << ran->out;
}

}  // namespace
}  // namespace postchain::service
