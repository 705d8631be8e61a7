// Reads the output of Slurm's programs; and programs that fail or hang.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/service/work/slurm_queue.h"

namespace postchain::service {
namespace {

using testing::HasSubstr;

TEST(Slurm, StatesOfTasks) {
    // Lines of scontrol 22.05: waiting tasks are grouped.
    const RemoteTasks tasks = tasks_of_scontrol(
        "JobId=12 ArrayJobId=12 ArrayTaskId=3,5-40%4 JobName=a JobState=PENDING Reason=Resources\n"
        "JobId=13 ArrayJobId=12 ArrayTaskId=1 JobName=a JobState=COMPLETED Reason=None\n"
        "JobId=14 ArrayJobId=12 ArrayTaskId=2 JobName=a JobState=RUNNING Reason=None\n"
        "JobId=15 ArrayJobId=12 ArrayTaskId=4 JobName=a JobState=NODE_FAIL Reason=None\n");
    EXPECT_EQ(tasks.waiting, 37);
    EXPECT_EQ(tasks.running, 1);
    EXPECT_EQ(tasks.done, 1);
    EXPECT_EQ(tasks.failed, 1);
    EXPECT_EQ(tasks.message, "task 4: NODE_FAIL");
    EXPECT_FALSE(tasks.ended());
    const RemoteTasks ended = tasks_of_sacct(
        "12_1|COMPLETED\n12_2|CANCELLED by 1000\n12_[5-6]|COMPLETED\n12_4|OUT_OF_MEMORY\n");
    EXPECT_TRUE(ended.ended());
    EXPECT_EQ(ended.done, 3);
    EXPECT_EQ(ended.failed, 2);
}

TEST(Programs, AreRunKilledAndQuoted) {
    using namespace std::chrono_literals;
    const auto ran = run_program({"sh", "-c", "cat; echo wrong >&2; exit 3"}, "text", 60s);
    ASSERT_TRUE(ran.ok()) << ran.status().message();
    EXPECT_EQ(ran->exit_code, 3);
    EXPECT_EQ(ran->out, "text");
    EXPECT_EQ(ran->err, "wrong\n");
    const auto hangs = run_program({"sleep", "1000"}, "", 200ms);
    EXPECT_THAT(hangs.status().message(), HasSubstr("did not answer"));
    EXPECT_THAT(run_program({"no-such-program"}, "", 60s).status().message(), HasSubstr("PATH"));
    const std::string odd = "a 'b' $c \"d\" \\";
    EXPECT_EQ(run_program({"sh", "-c", "printf %s " + shell_quoted(odd)}, "", 60s)->out, odd);
}

}  // namespace
}  // namespace postchain::service
