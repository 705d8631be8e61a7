// Reads the output of Slurm's programs; and programs that fail or hang.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "config/text_tree.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/service/store/job.h"
#include "tools/service/work/process.h"
#include "tools/service/work/slurm_queue.h"

namespace postchain::service {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

TEST(Slurm, StatesOfTasks) {
    // Lines of squeue 22.05: waiting tasks are grouped. Another job has no array.
    std::map<std::string, ArrayState> jobs{{"a", {}}, {"b", {}}, {"gone", {}}};
    add_tasks_of_squeue(
        "12|3,5-40%4|PENDING|a\n12|1|COMPLETED|a\n12|2|RUNNING|a\n12|4|NODE_FAIL|a\n"
        "16|N/A|RUNNING|other\n17|1|RUNNING|b\n\nslurm_load_jobs error: a\n12|1|RUNNING|a|b\n",
        jobs);
    const ArrayState& tasks = jobs["a"];
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
    std::map<std::string, ArrayState> ended{{"a", {}}};
    add_tasks_of_sacct(
        "12_1|COMPLETED|a\n12_2|CANCELLED by 1000|a\n12_[5-6]|COMPLETED|a\n12_4|OUT_OF_MEMORY|a\n"
        "12_7|FAILED|a job that had this id before\n12|FAILED|a\n\n12_8|FAILED|a|b\n",
        ended);
    EXPECT_TRUE(ended["a"].ended());
    EXPECT_EQ(ended["a"].done, 3);
    EXPECT_EQ(ended["a"].failed, 2);
}

// All of Slurm's, by what becomes of the task. A task that comes back has not failed.
TEST(Slurm, EveryStateIsKnown) {
    const std::vector<std::string> states[] = {
        {"PENDING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "CONFIGURING", "SUSPENDED",
         "SPECIAL_EXIT", "RESV_DEL_HOLD"},
        {"RUNNING", "COMPLETING", "STAGE_OUT", "SIGNALING", "STOPPED", "RESIZING"},
        {"COMPLETED"},
        {"BOOT_FAIL", "CANCELLED", "CANCELLED by 1000", "DEADLINE", "FAILED", "NODE_FAIL",
         "OUT_OF_MEMORY", "PREEMPTED", "REVOKED", "TIMEOUT"}};
    for (size_t kind = 0; kind < std::size(states); ++kind)
        for (const std::string& state : states[kind]) {
            std::map<std::string, ArrayState> queued{{"a", {}}}, ended{{"a", {}}};
            add_tasks_of_squeue("12|5|" + state + "|a\n", queued);
            add_tasks_of_sacct("12_5|" + state + "|a\n", ended);
            for (const ArrayState& tasks : {queued["a"], ended["a"]}) {
                const int counts[] = {tasks.waiting, tasks.running, tasks.done, tasks.failed};
                for (size_t i = 0; i < 4; ++i) EXPECT_EQ(counts[i], int(i == kind)) << state;
                EXPECT_EQ(tasks.ended(), kind > 1) << state;
                EXPECT_EQ(tasks.failed_task, kind == 3 ? 5 : 0) << state;
            }
        }
}

// The script, as a task runs it. `out`: its lines for the service.
ProgramResult ran_as_task(TaskArray job, const std::string& version, int task) {
    const test::TempFolder logs;
    job.log_folder = logs.path();
    const auto ran =
        run_program({{"env", concat("SLURM_ARRAY_TASK_ID=", task), "SLURM_CPUS_PER_TASK=3", "sh"}},
                    script_of(job, version), std::chrono::seconds(60));
    EXPECT_TRUE(ran.ok()) << ran.status().message();
    if (!ran.ok()) return {};
    ProgramResult result = *ran;
    const auto text = [&](const char* name) {
        const auto read = read_text_file(logs.path(concat(task, name)), StatusCode::input);
        return read.ok() ? *read : std::string();
    };
    result.out += text(".events");
    if (version.empty()) {
        EXPECT_EQ(text(".exit"), concat(result.exit_code, "\n"));
    }
    return result;
}

TEST(Slurm, AScriptRunsTheWordsOfItsTaskAndNoOtherVersion) {
    TaskArray job;
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
    job.command = {"sh", "-c", "exit 8"};
    EXPECT_EQ(ran_as_task(job, "", 1).exit_code, 8);
}

// Slurm's programs are scripts of these tests.
class SlurmPrograms : public testing::Test {
  protected:
    void SetUp() override { setenv("PATH", concat(folder_.path(), ":", path_).c_str(), 1); }
    void TearDown() override { setenv("PATH", path_.c_str(), 1); }

    // What `name` does; its words and input are kept.
    void add(const std::string& name, const std::string& script) {
        std::ofstream(folder_.path(name))
            << "#!/bin/sh\necho \"$@\" > " << folder_.path(name + ".words") << "\n"
            << script << "\n";
        std::filesystem::permissions(folder_.path(name), std::filesystem::perms::owner_all);
    }
    std::string words(const std::string& name) {
        return test::must(read_text_file(folder_.path(name + ".words"), StatusCode::input));
    }
    // The error of each call whose program fails with this text.
    StatusCode code_of(const std::string& text) {
        for (const char* name : {"sbatch", "squeue", "scontrol", "scancel"})
            add(name, "echo '" + text + "' >&2; exit 1");
        const StatusCode code = queue_.submit(job_).status().code();
        EXPECT_EQ(queue_.change("12", {}).code(), code) << text;
        EXPECT_EQ(queue_.cancel("12").code(), code) << text;
        EXPECT_EQ(queue_.look({}).status().code(), StatusCode::output) << text;
        return code;
    }

    const std::string path_ = std::getenv("PATH");
    test::TempFolder folder_;
    SlurmQueue queue_{
        SlurmSettings{.words = {"--account={user}-{user}"}, .memory = "8G", .cpus = 3, .nice = 7}};
    TaskArray job_{.name = "n1",
                   .owner = "ann",
                   .comment = "of ann",
                   .folder = "/work/at",
                   .command = {"echo"},
                   .tasks = {{}, {}},
                   .log_folder = "/logs",
                   .rank = {.priority = kMaxPriority - 2, .most_tasks = 4},
                   .after = "7"};
};

TEST_F(SlurmPrograms, AJobIsSubmitted) {
    add("sbatch", "cat > " + folder_.path("script") + "; echo '12;cluster'");
    EXPECT_EQ(test::must(queue_.submit(job_)), "12");
    EXPECT_EQ(words("sbatch"),
              "--parsable --requeue --open-mode=append --job-name=n1 --comment=of ann "
              "--chdir=/work/at --array=1-2%4 --nice=14 --cpus-per-task=3 --output=/logs/%a.log "
              "--mem=8G --dependency=afterany:7 --account=ann-ann\n");
    EXPECT_EQ(test::must(read_text_file(folder_.path("script"), StatusCode::input)),
              script_of(job_, ""));
    job_.rank.most_tasks = 0;
    job_.after = "";
    EXPECT_EQ(test::must(queue_.submit(job_)), "12");
    EXPECT_THAT(words("sbatch"), HasSubstr("--array=1-2 "));
    EXPECT_THAT(words("sbatch"), testing::Not(HasSubstr("--dependency")));
    EXPECT_EQ(test::must(SlurmQueue(SlurmSettings()).submit(job_)), "12");
    EXPECT_THAT(words("sbatch"), testing::Not(HasSubstr("--mem")));
    for (const char* answer : {"Submitted batch job 12", ""}) {
        add("sbatch", concat("echo '", answer, "'"));
        EXPECT_THAT(test::error_of(queue_.submit(job_)), HasSubstr("did not print a job's id"));
    }
}

TEST_F(SlurmPrograms, AJobIsChangedAndCanceled) {
    add("scontrol", "");
    add("scancel", "");
    EXPECT_EQ(test::error_of(queue_.change("12", job_.rank)), "");
    EXPECT_EQ(words("scontrol"), "update JobId=12 Nice=14 ArrayTaskThrottle=4\n");
    EXPECT_EQ(test::error_of(queue_.cancel("12")), "");
    EXPECT_EQ(words("scancel"), "12\n");
    // It has ended, and was forgotten.
    for (const char* name : {"scontrol", "scancel"})
        add(name, "echo 'error: Invalid job id specified' >&2; exit 1");
    EXPECT_EQ(test::error_of(queue_.change("12", job_.rank)), "");
    EXPECT_EQ(test::error_of(queue_.cancel("12")), "");
}

TEST_F(SlurmPrograms, JobsThatHaveLeftTheQueueAreLookedUp) {
    add("squeue", "echo '12|1|RUNNING|a'");
    add("sacct", "echo '13_1|COMPLETED|b'");
    auto found = test::must(queue_.look({{"a", "12"}, {"b", "13"}, {"c", ""}}));
    EXPECT_THAT(words("squeue"), HasSubstr(" --name=a,b,c\n"));
    EXPECT_THAT(words("sacct"), HasSubstr("-j 13 "));
    (void)queue_.look({{"b", "13"}, {"a", "12"}, {"d", "14"}});
    EXPECT_THAT(words("sacct"), HasSubstr("-j 13,14 "));
    EXPECT_EQ(found["a"].running, 1);
    EXPECT_EQ(found["b"].done, 1);
    EXPECT_FALSE(found["c"].known());
    // Without accounting.
    add("sacct", "echo 'Slurm accounting storage is disabled' >&2; exit 1");
    found = test::must(queue_.look({{"b", "13"}}));
    EXPECT_FALSE(found["b"].known());
}

TEST_F(SlurmPrograms, ARefusalIsNotASilence) {
    EXPECT_EQ(code_of("error: invalid partition"), StatusCode::usage);
    for (const char* text :
         {"error: Unable to contact slurm controller (connect failure)",
          "error: Socket timed out on send/recv operation", "error: Zero Bytes were transmitted",
          "error: Resource temporarily unavailable", "error: Connection refused",
          "error: Communication connection failure: slurm communication error",
          "error: slurm controller in backup mode", "error: Munge decode failed"})
        EXPECT_EQ(code_of(text), StatusCode::output) << text;
    EXPECT_EQ(code_of("error: Protocol authentication error"), StatusCode::output);
    EXPECT_EQ(test::error_of(queue_.cancel("12")), "scancel: error: Protocol authentication error");
    queue_.stop();
    EXPECT_THAT(test::error_of(queue_.cancel("12")), HasSubstr("shutting down"));
}

TEST(Programs, AreRunAndQuoted) {
    const auto ran = run_program({{"sh", "-c", "cat; echo wrong >&2; exit 3"}}, "text", 60s);
    ASSERT_TRUE(ran.ok()) << ran.status().message();
    EXPECT_EQ(ran->exit_code, 3);
    EXPECT_EQ(ran->out, "text");
    EXPECT_EQ(ran->err, "wrong\n");
    EXPECT_THAT(run_program({{"no-such-program"}}, "", 60s).status().message(), HasSubstr("PATH"));
    const std::string odd = "a 'b' $c \"d\" \\";
    EXPECT_EQ(run_program({{"sh", "-c", "printf %s " + shell_quoted(odd)}}, "", 60s)->out, odd);
}

// None of these waits for a program that sleeps 1000 s.
TEST(Programs, AreNotWaitedFor) {
    const auto start = std::chrono::steady_clock::now();
    const std::string much(1 << 20, 'x');  // a pipe holds 64 KiB
    for (const char* script : {"sleep 1000", "exec >&- 2>&-; sleep 1000"})
        EXPECT_THAT(run_program({{"sh", "-c", script}}, much, 300ms).status().message(),
                    HasSubstr("did not answer within 0.3 s"))
            << script;
    EXPECT_EQ(run_program({{"wc", "-c"}}, much, 60s)->out, "1048576\n");
    EXPECT_EQ(run_program({{"true"}}, much, 60s)->exit_code, 0);
    // A program that leaves another one with its streams.
    EXPECT_EQ(run_program({{"sh", "-c", "sleep 1000 & echo done"}}, "", 60s)->out, "done\n");
    // The service ends.
    std::atomic<bool> stop = false;
    std::thread signal([&] {
        std::this_thread::sleep_for(100ms);
        stop = true;
    });
    EXPECT_THAT(run_program({{"sleep", "1000"}}, "", 600s, &stop).status().message(),
                HasSubstr("was ended with the service"));
    signal.join();
    EXPECT_LT(std::chrono::steady_clock::now() - start, 30s);
}

TEST(Programs, InheritNoSocket) {
    const int opened = ::socket(AF_INET, SOCK_STREAM, 0);  // without SOCK_CLOEXEC
    const int listens = ::fcntl(opened, F_DUPFD, 100);
    ASSERT_GE(listens, 100);
    const auto ran = run_program({{"sh", "-c", "ls -l /proc/$$/fd"}}, "", 60s);
    ::close(listens);
    ::close(opened);
    EXPECT_THAT(ran->out, HasSubstr(" 2 -> ")) << ran->out;
    EXPECT_THAT(ran->out, testing::Not(HasSubstr("socket:"))) << ran->out;
}

}  // namespace
}  // namespace postchain::service
