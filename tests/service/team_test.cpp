// A service for several people: turns, folders, limits, previews, the log, and work that hangs.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>

#include "chain/planner.h"
#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tools/service/store/job_store.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ServiceTest;

constexpr const char* kTwoUsers =
    "  ann: {token: aaaaaaaaaaaaaaaa}\n"
    "  bob: {token: bbbbbbbbbbbbbbbb, roots: [bob], max_priority: 5}\n"
    "  ops: {token: oooooooooooooooo, admin: true}\n";

class Team : public ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        fs::create_directories(root("bob/out"));
    }
    std::string in_folder(std::string body, const std::string& folder) const {
        fs::create_directories(root(folder));
        body.replace(body.find("out/"), 4, folder + "/");
        return body;
    }
    std::string types_of(const std::string& id) const {
        std::string types;
        for (const Event& event : std::get<std::vector<Event>>(service_->events(id, 0, 1000)))
            types += event.type + " ";
        return types;
    }
    std::string logged() {
        const std::lock_guard lock(log_mutex_);
        std::string text;
        for (const LogLine& line : log_) text += line.message + "\n";
        return text;
    }
    void many_frames(int last) {
        for (int frame = 7; frame <= last; ++frame) test::write_sequence(root(), {frame}, 24, 16);
    }
};

// Planning frame 3, which belongs to its reading, does not end while `g_hangs`.
std::atomic<bool> g_hangs = false;

class HangingPass final : public PlainPass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        return use;
    }
    Guarantees guarantees() const override { return {}; }
    Reach reach() const override { return {}; }
    std::optional<Identity> identity(const PlanContext& context) const override {
        while (context.frame.frame_number == 3 && g_hangs) usleep(10'000);
        return Identity{kRuleFacts, {"nothing to do"}};
    }
    void plan(PassPlanner&) const override {}
    void reference(const PlanContext&, ReferenceFrame&) const override {}
    ParameterRef parameters() override { return &unused_; }

  private:
    char unused_ = 0;
};

class Hanging : public Team {
  protected:
    void SetUp() override {
        Team::SetUp();
        static const ParameterTable no_parameters;
        std::vector<PassType> types = registry_->types();
        types.push_back({.name = "hanging",
                         .title = "",
                         .help = "",
                         .parameters = &no_parameters,
                         .create = [] { return std::make_unique<HangingPass>(); }});
        with_hanging_ = std::make_unique<PassRegistry>(types);
        registry_ = with_hanging_.get();
        g_hangs = true;
        open();
    }
    void TearDown() override {
        answer();
        close();
        Team::TearDown();
    }
    // Lets the thread go, and waits until it has.
    bool answer() {
        g_hangs = false;
        return wait_for([&] {
            return service_->metrics().find("postchain_stuck_threads 0") != std::string::npos;
        });
    }
    static std::string hanging(const std::string& more = "") {
        std::string text = body(more);
        return text.replace(text.find("fxaa"), 4, "hanging");
    }
    std::unique_ptr<PassRegistry> with_hanging_;
};

TEST_F(Hanging, AReadThatHangsEndsItsJobAndNotTheService) {
    // The limit is for frames: what is made once is made before.
    ASSERT_EQ(ended(submit(in_folder(hanging(R"(, "frames": "1-2")"), "warm"))).state,
              JobState::done);
    const std::string id = submit(hanging(R"(, "frame_timeout": 4)"));
    const Job job = ended(id);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 4);
    EXPECT_EQ(job.done, 2);
    EXPECT_NE(job.message.find("frame 3 was not read within 4 s: the disk hangs"),
              std::string::npos)
        << job.message;
    EXPECT_EQ(frames(id)[2].attempts, 1);
    // Another thread has taken over, with a device of its own.
    const Job next = ended(submit(in_folder(body(R"(, "frames": "1-2,4-6")"), "next")));
    EXPECT_EQ(next.state, JobState::done) << next.message;
    const Health health = service_->health();
    EXPECT_TRUE(health.gl && health.progress) << health.why;
    EXPECT_NE(health.why.find("1 thread hangs"), std::string::npos) << health.why;
    EXPECT_NE(service_->metrics().find("postchain_workers_replaced_total 1"), std::string::npos);
    EXPECT_NE(service_->metrics().find("postchain_stuck_threads 1"), std::string::npos);
    EXPECT_NE(logged().find("failed"), std::string::npos) << logged();
    // The disk answers again, and the retry makes what is missing.
    ASSERT_TRUE(answer());
    ASSERT_TRUE(std::holds_alternative<Job>(service_->retry(user(), id)));
    EXPECT_EQ(ended(id).state, JobState::done) << ended(id).message;
    EXPECT_EQ(ended(id).done, 6);
    for (const JobFrame& frame : frames(id)) EXPECT_LE(frame.attempts, 1) << frame.frame;
}

TEST_F(Hanging, ReadinessFollowsTheProgress) {
    const std::string id = submit(hanging());
    ASSERT_TRUE(wait_for([&] { return job(id).done >= 2; }));
    EXPECT_TRUE(service_->health().progress) << "no limit";
    ASSERT_TRUE(std::holds_alternative<Job>(service_->cancel(user(), id)));
    service_->drain();  // does not wait for ever
    EXPECT_NE(service_->health().why.find("1 thread hangs"), std::string::npos);
}

TEST_F(Team, JobsOfTwoUsersInterleave) {
    many_frames(60);
    use(kTwoUsers);
    slice_s_ = 0;
    open();
    const std::string a = submit(body(), "ann");
    ASSERT_TRUE(wait_for([&] { return job(a).done >= 2; }));
    const std::string b = submit(in_folder(body(), "ops"), "ops");
    EXPECT_EQ(ended(a).state, JobState::done) << ended(a).message;
    EXPECT_EQ(ended(b).state, JobState::done) << ended(b).message;
    EXPECT_EQ(ended(a).owner, "ann");
    // Neither has waited for the end of the other.
    for (const std::string& id : {a, b})
        EXPECT_NE(types_of(id).find("requeued"), std::string::npos) << id << types_of(id);
    for (const std::string& id : {a, b})
        for (const JobFrame& frame : frames(id)) EXPECT_LE(frame.attempts, 1) << frame.frame;
}

TEST_F(Team, FoldersAndRightsOfAUser) {
    use(kTwoUsers);
    fs::create_directories(root("bob/out"));
    test::write_sequence(root("bob"), {1, 2}, 24, 16);
    open();
    EXPECT_EQ(refused(body(), "bob").kind, Problem::Kind::forbidden);
    std::string own = body();
    own.replace(own.find("in.####"), 0, "bob/");
    own.replace(own.find("out/"), 0, "bob/");
    const std::string id = submit(own, "bob");
    EXPECT_EQ(ended(id).state, JobState::done) << ended(id).message;
    EXPECT_EQ(refused(body(R"(, "priority": 6)"), "bob").kind, Problem::Kind::forbidden);
    const std::string of_ann = submit(body(), "ann");
    ended(of_ann);
    // Others may look, and not touch. An administrator may.
    EXPECT_EQ(job(of_ann).owner, "ann");
    const auto forget = service_->forget(user("bob"), of_ann);
    EXPECT_EQ(std::get<Problem>(forget).kind, Problem::Kind::forbidden);
    std::promise<Answer<Picture>> picture;
    service_->frame_image(user("bob"), of_ann, 1, true, {},
                          [&](Answer<Picture> got) { picture.set_value(std::move(got)); });
    EXPECT_TRUE(std::holds_alternative<Problem>(picture.get_future().get()));
    const Answer<std::string> folder = service_->browse(user("bob"), "out");
    EXPECT_EQ(std::get<Problem>(folder).kind, Problem::Kind::forbidden);
    std::promise<Answer<Picture>> input;
    service_->input_image(user("bob"), "out/o.####.exr", 1, {},
                          [&](Answer<Picture> got) { input.set_value(std::move(got)); });
    EXPECT_EQ(std::get<Problem>(input.get_future().get()).kind, Problem::Kind::forbidden);
    EXPECT_EQ(std::get<Problem>(service_->outputs(user("bob"), of_ann, 1, 6)).kind,
              Problem::Kind::forbidden);
    EXPECT_EQ(
        std::get<std::vector<ResultFile>>(service_->outputs(user("ann"), of_ann, 2, 4)).size(), 3u);
    ASSERT_TRUE(std::holds_alternative<Job>(service_->forget(user("ops"), of_ann)));
    EXPECT_TRUE(std::holds_alternative<Problem>(service_->job(of_ann)));
    EXPECT_TRUE(fs::exists(root("out/o.0001.exr"))) << "outputs stay";
    // The file is read again: bob is gone, and his waiting jobs fail.
    std::ofstream(folder_.path("users.yaml"))
        << "postchain_users: 1\nusers: {ann: {token: aaaaaaaaaaaaaaaa}}\n";
    const std::string session = users_->named("ann")->session;
    ASSERT_TRUE(users_->reload().ok());
    EXPECT_EQ(users_->named("ann")->session, session);
    EXPECT_EQ(users_->named("bob"), nullptr);
    std::ofstream(folder_.path("users.yaml")) << "postchain_users: 1\nusers: {ann: {tokn: a}}\n";
    const Status wrong = users_->reload();
    EXPECT_NE(wrong.message().find("users.yaml:2:"), std::string::npos) << wrong.message();
    EXPECT_NE(wrong.message().find("tokn"), std::string::npos) << wrong.message();
    EXPECT_NE(users_->named("ann"), nullptr) << "the former users stay";
}

TEST_F(Team, ABenchMakesWayForALargerPriority) {
    open();
    const std::string slow = submit(
        R"({"kind": "bench", "chain": {"postchain": 1, "passes": ["fxaa"]}, "priority": -1,
            "input": "in.####.exr", "frames": "1-6", "output": "bench", "repeats": 30,
            "split_frames": 0, "sweep": ["fxaa.preset=10,12,15,20,25,29,39"]})");
    ASSERT_TRUE(wait_for([&] { return types_of(slow).find("progress") != std::string::npos; }));
    const std::string urgent = submit(body());
    ASSERT_EQ(std::get<Job>(service_->change(user(), urgent, R"({"priority": 9})")).priority, 9);
    const Job first = ended(urgent);
    EXPECT_EQ(first.state, JobState::done);
    const Job other = ended(slow);
    EXPECT_EQ(other.state, JobState::done) << other.message;
    EXPECT_LE(first.ended_ms, other.ended_ms);
    EXPECT_NE(types_of(slow).find("requeued"), std::string::npos) << types_of(slow);
    for (const char* body : {R"({"priority": 101})", "{}", R"({"priority": "1"})",
                             R"({"priority": 1, "frames": 2})", "[]"})
        EXPECT_EQ(std::get<Problem>(service_->change(user(), slow, body)).kind,
                  Problem::Kind::invalid)
            << body;
    EXPECT_EQ(std::get<Problem>(service_->change(user(), slow, R"({"priority": 1})")).kind,
              Problem::Kind::conflict);
}

TEST_F(Team, TheNewestPreviewOfASessionWins) {
    test::write_sequence(root("bob"), {1}, 900, 600);
    open();
    const auto asked = [&](const std::string& session,
                           const std::shared_ptr<std::atomic<bool>>& left = nullptr) {
        auto promise = std::make_shared<std::promise<Answer<Picture>>>();
        service_->preview(user(),
                          R"({"chain": "best", "input": "bob/in.####.exr", "frame": 1,
                "set": ["camera.focal_length_mm=50", "camera.sensor_width_mm=36",
                        "camera.f_stop=2", "camera.focus_distance=3"]})",
                          {"image/png", session, left},
                          [promise](Answer<Picture> got) { promise->set_value(std::move(got)); });
        return promise->get_future();
    };
    auto first = asked("a"), second = asked("a"), other = asked("b"), third = asked("a");
    const auto left = std::make_shared<std::atomic<bool>>(true);
    auto gone = asked("", left);
    for (auto* replaced : {&first, &second}) {
        const auto answer = replaced->get();
        ASSERT_TRUE(std::holds_alternative<Problem>(answer));
        EXPECT_EQ(std::get<Problem>(answer).kind, Problem::Kind::conflict);
    }
    EXPECT_TRUE(std::holds_alternative<Picture>(other.get()));
    EXPECT_TRUE(std::holds_alternative<Picture>(third.get()));
    EXPECT_TRUE(std::holds_alternative<Problem>(gone.get()));
}

TEST_F(Team, TheLogHasALineForEachStartAndEnd) {
    use(kTwoUsers);
    std::ofstream(root("in.0003.exr"), std::ios::binary) << "no EXR";
    open();
    const std::string id = submit(body(), "ann");
    ended(id);
    ASSERT_TRUE(wait_for([&] {
        return logged().find("failed 0") != std::string::npos ||
               logged().find(" failed ") != std::string::npos;
    }));
    const std::string text = logged();
    for (const char* part : {"job 1 of ann queued: run, priority 0\n", "job 1 of ann started: run",
                             "job 1 of ann: frame 3 failed, attempt 1: in.0003.exr",
                             "job 1 of ann: frame 3 quarantined", "after its start: 5 of 6 frames"})
        EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
    EXPECT_EQ(text.find("aaaaaaaa"), std::string::npos) << "a token";
    const std::lock_guard lock(log_mutex_);
    EXPECT_EQ(log_.back().fields["event"], "failed");
    EXPECT_EQ(log_.back().fields["user"], "ann");
    EXPECT_EQ(log_.back().fields["job"], "1");
    EXPECT_TRUE(log_.back().fields["seconds"].is_number());
    const std::string metrics = service_->metrics();
    for (const char* part :
         {"postchain_jobs_ended_total{kind=\"run\",state=\"failed\"} 1\n",
          "postchain_queue_wait_seconds_count 1\n", "postchain_store_bytes ",
          "postchain_queue_oldest_seconds 0\n", "process_open_fds ", "process_cpu_seconds_total "})
        EXPECT_NE(metrics.find(part), std::string::npos) << part << "\n" << metrics;
}

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

    std::mutex mutex;
    std::vector<RemoteJob> jobs;
    std::vector<RemoteTasks> tasks;
    std::vector<std::string> canceled;
    bool down = false;
    std::atomic<bool> hangs = false, hung = false;  // look()
    Status refusal;                                 // of submit()
    int asked = 0;                                  // submit()
};

class Remote : public Team {
  protected:
    void SetUp() override {
        Team::SetUp();
        queue_ = std::make_shared<FakeQueue>();
        remote_.queue = queue_;
        remote_.folder = folder_.path("farm");
        remote_.frames_per_task = 4;
        remote_.poll = std::chrono::milliseconds(20);
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
    EXPECT_NE(refused(R"({"kind": "ab", "chain": "fast", "chain_b": "paper",
                          "input": "in.####.exr", "output": "report"})")
                  .detail.find("runs only kind: run"),
              std::string::npos);
    EXPECT_NE(refused(body(R"(, "dump_stages": "stages")")).detail.find("write no stages"),
              std::string::npos);
    const std::string id = submit(body(R"(, "strict": true, "png": true, "max_memory": "64M")"));
    ASSERT_TRUE(wait_for([&] { return queue_->count() == 1; }));
    const RemoteJob handed = queue_->jobs[0];
    EXPECT_EQ(handed.tasks, 2);
    EXPECT_EQ(handed.command[0], "postchain");
    EXPECT_NE(std::find(handed.command.begin(), handed.command.end(), "--on-existing=skip"),
              handed.command.end());
    EXPECT_EQ(handed.command.back(), "--frames=1-6");
    for (const char* word : {"--on-error=continue", "--strict", "--png", "--max-memory=67108864"})
        EXPECT_EQ(std::count(handed.command.begin(), handed.command.end(), word), 1) << word;
    EXPECT_NE(test::read_text(handed.command[2]).find("fxaa"), std::string::npos);
    for (int frame = 1; frame <= 4; ++frame) make(frame);
    ASSERT_TRUE(wait_for([&] { return job(id).done == 4; }));
    EXPECT_EQ(job(id).state, JobState::running);
    // The service dies and starts again: the same job is followed, none is handed over twice.
    queue_->down = true;
    close();
    open();
    ASSERT_TRUE(wait_for([&] { return !service_->health().why.empty(); }));
    queue_->down = false;
    // A task fails, so its frames are handed over again, under another name.
    queue_->end(0, {0, 0, 1, 1, true, "task 2: NODE_FAIL"});
    ASSERT_TRUE(wait_for([&] { return queue_->count() == 2; }));
    EXPECT_EQ(queue_->jobs[1].command.back(), "--frames=5-6");
    EXPECT_NE(queue_->jobs[1].name, handed.name);
    EXPECT_NE(frames(id)[4].message.find("task 2: NODE_FAIL"), std::string::npos);
    make(5);
    queue_->end(1, {0, 0, 0, 1, true, "task 1: FAILED"});
    const Job failed = ended(id);
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_NE(failed.message.find("1 of 6 frames quarantined: 6"), std::string::npos)
        << failed.message;
    EXPECT_EQ(queue_->count(), 2u) << "two attempts";
    ASSERT_TRUE(std::holds_alternative<Job>(service_->retry(user(), id)));
    ASSERT_TRUE(wait_for([&] { return queue_->count() == 3; }));
    make(6);
    queue_->end(2, {0, 0, 1, 0, false, ""});
    EXPECT_EQ(ended(id).state, JobState::done) << ended(id).message;
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
    {
        const std::lock_guard lock(queue_->mutex);
        queue_->refusal = Status();
    }
    ASSERT_TRUE(wait_for([&] { return queue_->count() == 1; }));
    const std::vector<std::string> command = queue_->jobs[0].command;
    EXPECT_EQ(command.back(), "--frames=1-2,4,6");
    EXPECT_EQ(std::count(command.begin(), command.end(), "--no-sidecar"), 1);
    {
        const std::lock_guard lock(queue_->mutex);
        queue_->refusal = Status(StatusCode::usage, "fake: invalid partition");
        queue_->asked = 0;
    }
    const Job refused = ended(submit(in_folder(body(), "next")));
    EXPECT_EQ(refused.state, JobState::failed);
    EXPECT_NE(refused.message.find("fake: invalid partition"), std::string::npos);
    EXPECT_EQ(queue_->asked, attempts_);
}

TEST_F(Remote, AQueueThatHangsIsNotWaitedFor) {
    remote_.drain = std::chrono::milliseconds(100);
    open();
    submit(body());
    ASSERT_TRUE(wait_for([&] { return queue_->count() == 1; }));
    queue_->hangs = true;
    ASSERT_TRUE(wait_for([&] { return queue_->hung.load(); }));
    service_->drain();
    EXPECT_NE(service_->health().why.find("1 thread hangs"), std::string::npos);
    EXPECT_EQ(service_->end(), 1u);
    queue_->hangs = false;
    EXPECT_TRUE(wait_for([&] { return service_->end() == 0; })) << "the thread has ended";
}

TEST_F(Remote, ACanceledJobIsCanceledThere) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(wait_for([&] { return queue_->count() == 1; }));
    ASSERT_TRUE(wait_for([&] { return job(id).frames == 6; }));
    ASSERT_TRUE(std::holds_alternative<Job>(service_->cancel(user(), id)));
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(queue_->mutex);
        return queue_->canceled == std::vector<std::string>{"1"};
    }));
}

}  // namespace
}  // namespace postchain::service
