// Jobs that another queue runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/command/frames.h"
#include "tests/service/support.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using test::ServiceTest;
using testing::HasSubstr;

// A queue in memory: takes jobs, and runs them when the test says so.
class FakeQueue final : public RemoteQueue {
  public:
    std::string name() const override { return "fake"; }
    Result<std::string> submit(const RemoteJob& job) override {
        const std::lock_guard lock(mutex);
        ++asked;
        if (!refusal.ok()) return refusal;
        jobs.push_back(job);
        tasks.push_back({job.tasks, 0, 0, 0, true, ""});
        if (loses_answers) return Status(StatusCode::output, "fake: the answer was lost");
        return std::to_string(jobs.size());
    }
    Result<std::string> find(const std::string& name) override {
        const std::lock_guard lock(mutex);
        for (size_t i = 0; i < jobs.size(); ++i)
            if (jobs[i].name == name && !tasks[i].ended()) return std::to_string(i + 1);
        return std::string();
    }
    Result<RemoteTasks> look(const std::string& id) override {
        for (; hangs; usleep(10'000)) hung = true;
        const std::lock_guard lock(mutex);
        if (down) return Status(StatusCode::output, "fake: does not answer");
        return tasks[std::stoul(id) - 1];
    }
    Status cancel(const std::string& id) override {
        const std::lock_guard lock(mutex);
        canceled.push_back(id);
        tasks[std::stoul(id) - 1] = {0, 0, 0, 1, true, "task 1: CANCELLED"};
        return Status();
    }
    size_t count() {
        const std::lock_guard lock(mutex);
        return jobs.size();
    }
    void end(size_t i, const RemoteTasks& how) {
        const std::lock_guard lock(mutex);
        tasks[i] = how;
    }
    void refuse(const Status& status) {
        const std::lock_guard lock(mutex);
        refusal = status;
        asked = 0;
    }

    std::mutex mutex;
    std::vector<RemoteJob> jobs;
    std::vector<RemoteTasks> tasks;
    std::vector<std::string> canceled;
    bool down = false;
    std::atomic<bool> hangs = false, hung = false;  // look()
    bool loses_answers = false;                     // of submit(), which takes the job
    Status refusal;                                 // of submit()
    int asked = 0;                                  // submit()
};

class Remote : public ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        queue_ = std::make_shared<FakeQueue>();
        remote_.queue = queue_;
        remote_.folder = folder_.path("farm");
        remote_.frames_per_task = 4;
        remote_.poll = std::chrono::milliseconds(20);
    }
    bool holds(size_t count) {
        return wait_for([&] { return queue_->count() == count; });
    }
    // As a task does: the output, then its sidecar.
    void make(int frame) {
        const std::string path = root(concat("out/o.000", frame, ".exr"));
        fs::copy_file(root(concat("in.000", frame, ".exr")), path);
        fs::last_write_time(path, fs::file_time_type::clock::now() + std::chrono::seconds(1));
        std::ofstream(path + ".json") << "{}";
    }
    std::shared_ptr<FakeQueue> queue_;
};

TEST_F(Remote, AJobIsHandedOverAndFollowedByItsOutputs) {
    open();
    EXPECT_THAT(refused(R"({"kind": "ab", "chain": "fast", "chain_b": "paper",
                          "input": "in.####.exr", "output": "report"})")
                    .detail,
                HasSubstr("runs only kind: run"));
    EXPECT_THAT(refused(body(R"(, "dump_stages": "stages")")).detail, HasSubstr("write no stages"));
    const std::string id = submit(body(R"(, "strict": true, "png": true, "max_memory": "64M")"));
    ASSERT_TRUE(holds(1));
    const RemoteJob handed = queue_->jobs[0];
    EXPECT_EQ(handed.tasks, 2);
    EXPECT_EQ(handed.command[0], "postchain");
    EXPECT_EQ(handed.command.back(), "--frames=1-6");
    for (const char* word : {"--on-existing=skip", "--on-error=continue", "--strict", "--png",
                             "--max-memory=67108864"})
        EXPECT_THAT(handed.command, testing::Contains(word));
    EXPECT_THAT(test::read_text(handed.command[2]), HasSubstr("fxaa"));
    for (int frame = 1; frame <= 4; ++frame) make(frame);
    wait_for_done(id, 4);
    EXPECT_EQ(job(id).state, JobState::running);
    // The service dies and starts again: the same job is followed, none is handed over twice.
    queue_->down = true;
    close();
    open();
    ASSERT_TRUE(wait_for([&] { return !service_->health().why.empty(); }));
    queue_->down = false;
    // A task fails, so its frames are handed over again, under another name.
    queue_->end(0, {0, 0, 1, 1, true, "task 2: NODE_FAIL"});
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(queue_->jobs[1].command.back(), "--frames=5-6");
    EXPECT_NE(queue_->jobs[1].name, handed.name);
    EXPECT_THAT(frames(id)[4].message, HasSubstr("task 2: NODE_FAIL"));
    make(5);
    queue_->end(1, {0, 0, 0, 1, true, "task 1: FAILED"});
    const Job failed = ended(id);
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_THAT(failed.message, HasSubstr("1 of 6 frames quarantined: 6"));
    EXPECT_EQ(queue_->count(), 2u) << "two attempts";
    retry(id);
    ASSERT_TRUE(holds(3));
    make(6);
    queue_->end(2, {0, 0, 1, 0, false, ""});
    done(id);
}

TEST_F(Remote, ARefusedJobFailsAndOneWithoutAnswerWaits) {
    queue_->refusal = Status(StatusCode::output, "fake: does not answer");
    open();
    const std::string id = submit(body(R"(, "sidecar": false, "frames": "1,2,4,6")"));
    ASSERT_TRUE(wait_for([&] {
        const std::lock_guard lock(queue_->mutex);
        return queue_->asked > 2 * attempts_;
    }));
    EXPECT_EQ(job(id).state, JobState::running);
    queue_->refuse(Status());
    ASSERT_TRUE(holds(1));
    EXPECT_EQ(queue_->jobs[0].command.back(), "--frames=1-2,4,6");
    EXPECT_THAT(queue_->jobs[0].command, testing::Contains("--no-sidecar"));
    queue_->refuse(Status(StatusCode::usage, "fake: invalid partition"));
    const Job refused = ran(in_folder(body(), "next"));
    EXPECT_EQ(refused.state, JobState::failed);
    EXPECT_THAT(refused.message, HasSubstr("fake: invalid partition"));
    EXPECT_EQ(queue_->asked, attempts_);
}

// As after the death of a process between its submission and its note of it.
TEST_F(Remote, AJobThatTheQueueHasIsNotHandedOverAgain) {
    queue_->loses_answers = true;
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    for (int frame = 1; frame <= 6; ++frame) make(frame);
    wait_for_done(id, 6);
    queue_->end(0, {0, 0, 2, 0, true, ""});
    done(id);
    EXPECT_EQ(queue_->count(), 1u);
}

TEST_F(Remote, AQueueThatHangsIsNotWaitedFor) {
    drain_ = std::chrono::milliseconds(100);
    open();
    submit(body());
    ASSERT_TRUE(holds(1));
    queue_->hangs = true;
    ASSERT_TRUE(wait_for([&] { return queue_->hung.load(); }));
    service_->drain();
    EXPECT_THAT(service_->health().why, HasSubstr("1 thread hangs"));
    EXPECT_EQ(service_->end(), 1u);
    queue_->hangs = false;
    EXPECT_TRUE(wait_for([&] { return service_->end() == 0; })) << "the thread has ended";
}

TEST_F(Remote, ACanceledJobIsCanceledThere) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    ASSERT_TRUE(wait_for([&] { return job(id).frames == 6; }));
    test::got(service_->cancel(user(), id));
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(queue_->mutex);
        return queue_->canceled == std::vector<std::string>{"1"};
    }));
}

}  // namespace
}  // namespace postchain::service
