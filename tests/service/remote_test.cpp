// Jobs that another queue runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tools/sequence/files/json.h"
#include "tools/service/work/remote_backend.h"

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
        if (jobs.size() >= most) return Status(StatusCode::usage, "fake: too many jobs");
        jobs.push_back(job);
        ranks.push_back(job.rank);
        const std::string id = std::to_string(jobs.size());
        tasks.push_back({id, int(job.tasks.size())});
        if (loses_answers) return Status(StatusCode::output, "fake: the answer was lost");
        return id;
    }
    Result<std::map<std::string, RemoteTasks>> look(const std::vector<RemoteName>& names) override {
        for (; hangs; usleep(10'000)) hung = true;
        if (breaks) throw std::runtime_error("fake: is broken");
        const std::lock_guard lock(mutex);
        ++looked;
        if (down) return Status(StatusCode::output, "fake: does not answer");
        std::map<std::string, RemoteTasks> found;
        for (const RemoteName& one : names)
            for (size_t i = 0; i < jobs.size(); ++i)
                if (jobs[i].name == one.name) found[one.name] = tasks[i];
        return found;
    }
    Status change(const std::string& id, const RemoteRank& rank) override {
        const std::lock_guard lock(mutex);
        if (id == changes_not) throw std::runtime_error("fake: cannot be changed");
        ranks[std::stoul(id) - 1] = rank;
        return Status();
    }
    Status cancel(const std::string& id) override {
        const std::lock_guard lock(mutex);
        canceled.push_back(id);
        tasks[std::stoul(id) - 1] = {id, 0, 0, 0, 1, 1, "task 1: CANCELLED"};
        return Status();
    }
    void stop() override { stopped = true; }
    size_t count() {
        const std::lock_guard lock(mutex);
        return jobs.size();
    }
    // Ends the tasks of job `i`: so many well, so many not.
    void end(size_t i, int done, int failed, const std::string& message = "") {
        const std::lock_guard lock(mutex);
        tasks[i] = {tasks[i].id, 0, 0, done, failed, failed, message};
    }
    void refuse(const Status& status) {
        const std::lock_guard lock(mutex);
        refusal = status;
        asked = 0;
    }
    RemoteRank rank(size_t i) {
        const std::lock_guard lock(mutex);
        return ranks[i];
    }

    std::mutex mutex;
    std::vector<RemoteJob> jobs;
    std::vector<RemoteTasks> tasks;
    std::vector<RemoteRank> ranks;
    std::vector<std::string> canceled;
    std::atomic<bool> down = false, stopped = false;
    std::atomic<bool> hangs = false, hung = false;  // look()
    std::atomic<bool> breaks = false;               // look() throws
    std::string changes_not;                        // the id for which change() throws
    bool loses_answers = false;                     // of submit(), which takes the job
    Status refusal;                                 // of submit()
    size_t most = 1000;                             // jobs that it takes
    int asked = 0;                                  // submit()
    int looked = 0;
};

class Remote : public ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        queue_ = std::make_shared<FakeQueue>();
        remote_.queue = queue_;
        remote_.folder = folder_.path("farm");
        remote_.frames_per_task = 4;
        remote_.poll = remote_.idle_poll = std::chrono::milliseconds(20);
        remote_.lag = std::chrono::milliseconds(0);
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
    // "done/total what" of the last event of this type, once it is `shown`.
    bool says(const std::string& id, const std::string& shown) {
        return wait_for([&] {
            std::string last;
            for (const Event& event : events(id)) {
                if (event.type != "progress") continue;
                const auto data = io::Json::parse(event.data);
                last = concat(data["done"].get<int>(), "/", data["total"].get<int>(), " ",
                              data["what"].get<std::string>());
            }
            return last == shown;
        });
    }
    std::shared_ptr<FakeQueue> queue_;
};

TEST_F(Remote, AJobIsHandedOverAndFollowedByItsOutputs) {
    open();
    EXPECT_THAT(refused(R"({"kind": "study", "output": "s", "study": {"postchain_study": 1,
                          "scenes": [{"name": "a", "input": "in.####.exr", "truth": "in.####.exr"}],
                          "chains": {"x": "fast", "y": "paper"}}})")
                    .detail,
                HasSubstr("name one"));
    EXPECT_THAT(refused(body(R"(, "dump_stages": "stages")")).detail, HasSubstr("write no stages"));
    const std::string id =
        submit(body(R"(, "strict": true, "png": true, "max_memory": "64M", "precision": "fp16",
                       "half": true, "cuts": "9", "nonfinite": "zero", "no_elide": "all")"));
    ASSERT_TRUE(holds(1));
    const RemoteJob handed = queue_->jobs[0];
    using Words = std::vector<std::vector<std::string>>;
    EXPECT_EQ(handed.tasks, (Words{{"--frames=1-3"}, {"--frames=4-6"}}));
    EXPECT_EQ(handed.command[0], "postchain");
    for (const char* word :
         {"--on-existing=skip", "--on-error=continue", "--strict", "--png", "--max-memory=67108864",
          "--precision=fp16", "--half", "--cuts=9", "--nonfinite=zero", "--no-elide=all"})
        EXPECT_THAT(handed.command, testing::Contains(word));
    EXPECT_THAT(handed.command, testing::Contains("--confine-to=" + root()));
    EXPECT_THAT(handed.command, testing::Contains("--also-read=" + handed.log_folder));
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
    std::ofstream(handed.log_folder + "/1.log")
        << "started\nthe disk of " << root() << " is full\n";
    queue_->end(0, 1, 1, "task 1: NODE_FAIL");
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(queue_->jobs[1].tasks, (Words{{"--frames=5-6"}}));
    EXPECT_NE(queue_->jobs[1].name, handed.name);
    EXPECT_EQ(frames(id)[4].message, "task 1: NODE_FAIL: the disk of . is full");
    make(5);
    queue_->end(1, 0, 1, "task 1: FAILED");
    const Job failed = ended(id);
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_THAT(failed.message, HasSubstr("1 of 6 frames quarantined: 6; frame 6: task 1: FAILED"));
    EXPECT_EQ(queue_->count(), 2u) << "two attempts";
    retry(id);
    ASSERT_TRUE(holds(3));
    make(6);
    // The queue has forgotten it.
    queue_->end(2, 0, 0);
    done(id);
    EXPECT_TRUE(wait_for([&] { return !fs::exists(handed.log_folder); })) << "it is cleaned up";
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
    EXPECT_EQ(queue_->jobs[0].tasks[0][0], "--frames=1-2,4,6");
    EXPECT_THAT(queue_->jobs[0].command, testing::Contains("--no-sidecar"));
    queue_->refuse(Status(StatusCode::usage, "fake: invalid partition"));
    const Job refused = ran(in_folder(body(), "next"));
    EXPECT_EQ(refused.state, JobState::failed);
    EXPECT_THAT(refused.message, HasSubstr("fake: invalid partition"));
    EXPECT_EQ(queue_->asked, attempts_);
    // Every second frame, with a second render behind each, which is a file of its own.
    queue_->refuse(Status());
    for (const int frame : {1, 3, 5, 6})
        fs::copy(root(concat("in.000", frame, ".exr")), root(concat("b.000", frame, ".exr")));
    submit(in_folder(body(R"(, "frames": "1-5x2,6", "behind": "b.####.exr")"), "o"));
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(queue_->jobs[1].tasks, (std::vector<std::vector<std::string>>{{"--frames=1-5x2,6"}}));
    EXPECT_EQ(queue_->jobs[1].command[4],
              concat("color=", fs::canonical(root()).string(),
                     "/in.####.exr,behind=", fs::canonical(root()).string(), "/b.####.exr"));
}

TEST_F(Remote, AnOutputFolderIsMadeIfItsJobSaysSo) {
    remote_.max_jobs = 1;
    open();
    const std::string before = submit(body());
    ASSERT_TRUE(holds(1));
    const std::string fails = submit(in_folder(body(), "gone"));
    const std::string made = submit(in_folder(body(R"(, "mkdir": true)"), "made"));
    const std::string exists = submit(in_folder(body(R"(, "frames": "1")"), "there"));
    std::ofstream(root("there/o.0001.exr")) << "mine";
    for (const char* folder : {"gone", "made"}) fs::remove_all(root(folder));
    test::got(service_->cancel(user(), before));
    EXPECT_EQ(ended(fails).state, JobState::failed);
    EXPECT_THAT(job(fails).message, HasSubstr("gone: folder does not exist"));
    EXPECT_FALSE(fs::exists(root("gone")));
    ASSERT_TRUE(holds(2));
    EXPECT_TRUE(fs::is_directory(root("made")));
    // None of its frames can be made: there is nothing to hand over.
    test::got(service_->cancel(user(), made));
    EXPECT_THAT(ended(exists).message, HasSubstr("1 of 1 frames quarantined: 1"));
    EXPECT_EQ(test::read_text(root("there/o.0001.exr")), "mine");
    EXPECT_EQ(queue_->count(), 2u);
}

TEST_F(Remote, ALimitOfTheDiskCancelsTheTasks) {
    use("  ann: {token: aaaaaaaaaaaaaaaa, max_disk: \"100\"}\n");
    remote_.max_jobs = 1;
    open();
    const std::string id = submit(body(), "ann");
    const std::string waiting = submit(in_folder(body(), "other"), "ann");
    ASSERT_TRUE(holds(1));
    make(1);
    EXPECT_THAT(ended(id).message, HasSubstr("max_disk: the jobs of ann have written"));
    EXPECT_EQ(job(id).done, 1);
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(queue_->mutex);
        return queue_->canceled == std::vector<std::string>{"1"};
    }));
    EXPECT_THAT(ended(waiting).message, HasSubstr("max_disk"));
    EXPECT_EQ(queue_->count(), 1u) << "it is not handed over";
}

// As after the death of a process between its submission and its note of it.
TEST_F(Remote, AJobThatTheQueueHasIsNotHandedOverAgain) {
    queue_->loses_answers = true;
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    for (int frame = 1; frame <= 6; ++frame) make(frame);
    wait_for_done(id, 6);
    queue_->end(0, 2, 0);
    done(id);
    EXPECT_EQ(queue_->count(), 1u);
    // The name is no other's: it cannot be foreseen.
    EXPECT_EQ(queue_->jobs[0].name.size(), std::string("postchain-").size() + 32);
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
    EXPECT_TRUE(queue_->stopped);
    queue_->hangs = false;
    EXPECT_TRUE(wait_for([&] { return service_->end() == 0; })) << "the thread has ended";
}

TEST_F(Remote, AQueueThatIsSilentIsSeen) {
    remote_.silence = std::chrono::milliseconds(300);
    open();
    EXPECT_TRUE(service_->health().gl);
    queue_->down = true;
    ASSERT_TRUE(wait_for([&] { return !service_->health().gl; }));
    EXPECT_THAT(service_->health().why, HasSubstr("fake has not answered for"));
    EXPECT_TRUE(service_->alive()) << "a restart does not help";
    queue_->down = false;
    EXPECT_TRUE(wait_for([&] { return service_->health().gl; }));
    queue_->hangs = true;
    EXPECT_TRUE(wait_for([&] { return !service_->health().gl; }));
    queue_->hangs = false;
    EXPECT_TRUE(wait_for([&] { return service_->health().gl; }));
}

TEST_F(Remote, AnExceptionOfOneJobEndsThatJobAlone) {
    open();
    const std::string breaks = submit(body());
    ASSERT_TRUE(holds(1));
    const std::string id = submit(in_folder(body(), "o"));
    ASSERT_TRUE(holds(2));
    {
        const std::lock_guard lock(queue_->mutex);
        queue_->changes_not = "1";
    }
    for (const std::string& one : {breaks, id})
        test::got(service_->change(user(), one, R"({"priority": 50})"));
    const Job failed = ended(breaks);
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_THAT(failed.message, HasSubstr("fake: cannot be changed"));
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(queue_->mutex);
        return queue_->canceled == std::vector<std::string>{"1"};
    })) << "its tasks";
    EXPECT_TRUE(wait_for([&] { return queue_->rank(1).priority == 50; }));
    EXPECT_EQ(job(id).state, JobState::running);
}

TEST_F(Remote, APollThatFailsIsSeen) {
    open();
    queue_->breaks = true;
    ASSERT_TRUE(wait_for([&] { return !service_->health().gl; }));
    EXPECT_THAT(service_->health().why, HasSubstr("fake: is broken"));
    queue_->breaks = false;
    EXPECT_TRUE(wait_for([&] { return service_->health().gl; }));
    EXPECT_EQ(service_->health().why, "");
}

TEST_F(Remote, JobsWaitForRoomInTheOrderOfTheService) {
    use("  ann: {token: aaaaaaaaaaaaaaaaaaaa, max_priority: 100}\n"
        "  bob: {token: bbbbbbbbbbbbbbbbbbbb, max_priority: 100}\n");
    remote_.max_jobs = 3;
    remote_.max_jobs_of_user = 2;
    remote_.max_tasks = 6;
    max_queue_ = 2;
    open();
    auto next = [&, at = 0](const std::string& user, const std::string& more = "") mutable {
        return submit(in_folder(body(more), concat("o", ++at)), user);
    };
    next("ann");
    ASSERT_TRUE(holds(1));
    next("ann");
    ASSERT_TRUE(holds(2));
    const std::string third = next("ann");
    EXPECT_EQ(job(third).place, 1) << "ann has two in the queue";
    EXPECT_TRUE(wait_for([&] { return queue_->rank(0).most_tasks == 3; }));
    next("bob", R"(, "priority": 7)");
    ASSERT_TRUE(holds(3));
    EXPECT_EQ(queue_->jobs[2].owner, "bob");
    EXPECT_THAT(queue_->jobs[2].comment, HasSubstr("job 4 of bob"));
    // Each user has half of the tasks, ann's jobs a quarter and a half of it.
    EXPECT_TRUE(wait_for([&] {
        return queue_->rank(0).most_tasks == 1 && queue_->rank(1).most_tasks == 1 &&
               queue_->rank(2) == RemoteRank{7, 3};
    }));
    next("bob");
    EXPECT_THAT(refused(in_folder(body(), "o6"), "bob").detail, HasSubstr("2 jobs are waiting"));
    EXPECT_EQ(queue_->count(), 3u);
    // A job in the queue, and one that waits, get another priority.
    test::got(service_->change(user("ann"), "1", R"({"priority": 50})"));
    EXPECT_TRUE(wait_for([&] { return queue_->rank(0).priority == 50; }));
    test::got(service_->change(user("ann"), third, R"({"priority": 40})"));
    test::got(service_->cancel(user("ann"), "2"));
    ASSERT_TRUE(holds(4));
    EXPECT_EQ(queue_->jobs[3].owner, "ann");
    EXPECT_EQ(queue_->jobs[3].rank.priority, 40);
}

TEST_F(Remote, OneCallFollowsAllJobs) {
    remote_.poll = std::chrono::milliseconds(200);
    open();
    for (int i = 0; i < 8; ++i) submit(in_folder(body(), concat("o", i)));
    ASSERT_TRUE(holds(8));
    usleep(300'000);
    const std::lock_guard lock(queue_->mutex);
    EXPECT_LT(queue_->looked, 25) << "eight submissions wake it too";
}

// The file appears on this machine some time after its task has ended.
TEST_F(Remote, FilesMayComeLateOverNfs) {
    remote_.lag = std::chrono::seconds(60);
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    for (int frame = 1; frame <= 5; ++frame) make(frame);
    queue_->end(0, 2, 0);
    wait_for_done(id, 5);
    usleep(200'000);
    EXPECT_EQ(job(id).state, JobState::running);
    EXPECT_EQ(frames(id)[5].attempts, 0);
    make(6);
    done(id);
    EXPECT_EQ(queue_->count(), 1u);
}

// With the wait for files in each attempt, and as many attempts after a retry.
TEST_F(Remote, AttemptsAreAlike) {
    remote_.lag = std::chrono::milliseconds(120);
    open();
    size_t tasks = 0;
    for (const std::string& request :
         {body(R"(, "frames": "1")"),
          std::string(R"({"kind": "ab", "chain": "fast", "chain_b": "paper", "frames": "1",
                          "input": "in.####.exr", "output": "report"})")}) {
        const std::string id = submit(request);
        for (int attempt = 1; attempt <= 2 * attempts_; ++attempt) {
            ASSERT_TRUE(holds(++tasks)) << attempt;
            const auto end = std::chrono::steady_clock::now();
            queue_->end(tasks - 1, 0, 1, "task 1: FAILED");
            if (attempt % attempts_ == 0) {
                EXPECT_EQ(ended(id).state, JobState::failed);
                if (attempt == attempts_) retry(id);
            } else {
                ASSERT_TRUE(holds(tasks + 1)) << attempt;
            }
            EXPECT_GE(std::chrono::steady_clock::now() - end, remote_.lag) << attempt;
        }
        EXPECT_EQ(queue_->count(), tasks);
    }
}

// What a task writes: a report, and its exit code.
void write_report(const std::string& folder, const std::string& codes, int code,
                  const std::string& variants = "[]",
                  const std::string& comparison = R"("comparison": {"verdict": "A is closer"}, )") {
    fs::create_directories(folder);
    std::ofstream(folder + "/report.json")
        << "{" << comparison << R"("variants": )" << variants << "}";
    fs::last_write_time(folder + "/report.json",
                        fs::file_time_type::clock::now() + std::chrono::seconds(1));
    std::ofstream(codes + "/1.exit") << code;
}

TEST_F(Remote, AnExperimentIsOneTask) {
    open();
    const std::string id = submit(
        R"({"kind": "ab", "chain": "fast", "chain_b": "paper", "set": ["fxaa.exposure_ev=1"],
            "input": "in.####.exr", "frames": "1-2", "output": "report", "ppd": 40,
            "fail_above": ["flip=0.5"], "priority": 3})");
    ASSERT_TRUE(holds(1));
    const RemoteJob handed = queue_->jobs[0];
    ASSERT_EQ(handed.tasks.size(), 1u);
    EXPECT_TRUE(handed.keeps_exit_code);
    EXPECT_EQ(handed.folder, fs::canonical(root()).string()) << "relative paths start there";
    EXPECT_THAT(test::read_text(handed.command[2]), HasSubstr("exposure_ev: 1"));
    EXPECT_EQ(handed.command[3], handed.log_folder + "/b/paper.yaml");
    for (const char* word : {"ab", "--input=in.####.exr", "--frames=1-2", "--ppd=40",
                             "--fail-above=flip=0.5", "--on-existing=overwrite"})
        EXPECT_THAT(handed.command, testing::Contains(word));
    std::ofstream log(handed.log_folder + "/1.log");
    log << "postchain: warning: 9/9, of something else\n"
        << std::string(5000, '.') << "\n1/6, frame 1, fast, 0:01 elapsed, 0:06 to go\n"
        << "2/6, frame 1 of " << root() << ", paper, 0:02 elapsed\n3/6, frame 2, fa" << std::flush;
    EXPECT_TRUE(says(id, "2/6 frame 1 of ., paper"));
    log << "st, 0:02 elapsed\n4/6, frame 2\n" << std::flush;
    EXPECT_TRUE(says(id, "3/6 frame 2, fast"));
    EXPECT_EQ(test::count_of(types_of(id), "progress"), 2) << "it says each once";
    // A node dies: another attempt. Then the task exceeds a limit, and has written its report.
    std::ofstream(handed.log_folder + "/1.exit") << 1;
    queue_->end(0, 0, 1, "task 1: NODE_FAIL");
    ASSERT_TRUE(holds(2));
    EXPECT_FALSE(fs::exists(handed.log_folder + "/1.exit")) << "a code of the first attempt";
    write_report(root("report"), handed.log_folder, 8);
    queue_->end(1, 0, 1, "task 1: FAILED");
    const Job done = ended(id);
    EXPECT_EQ(done.state, JobState::done);
    EXPECT_EQ(done.exit_code, 8);
    EXPECT_EQ(done.verdict, "A is closer");
    EXPECT_GT(done.bytes, 0);
    // A fault that no other attempt mends.
    const std::string swept = submit(
        R"({"kind": "bench", "chain": "fast", "sweep": ["fxaa.preset=12,29"],
            "input": "in.####.exr", "output": "swept"})");
    ASSERT_TRUE(holds(3));
    write_report(root("swept"), queue_->jobs[2].log_folder, 0,
                 R"([{"pareto": true}, {"pareto": false}])", R"("under": ["one", "two"], )");
    queue_->end(2, 1, 0);
    EXPECT_EQ(ended(swept).verdict, "2 variants, 1 in the Pareto set; one; two");
    const std::string bad = submit(
        R"({"kind": "bench", "chain": "fast", "sweep": ["fxaa.preset=12,29"],
            "input": "in.####.exr", "output": "bench"})");
    ASSERT_TRUE(holds(4));
    EXPECT_THAT(queue_->jobs[3].command, testing::Contains("--sweep=fxaa.preset=12,29"));
    std::ofstream(queue_->jobs[3].log_folder + "/1.log") << "in.0003.exr: is damaged\n\n";
    std::ofstream(queue_->jobs[3].log_folder + "/1.exit") << 4;
    queue_->end(3, 0, 1, "task 1: FAILED");
    const Job failed = ended(bad);
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_EQ(failed.exit_code, 4);
    EXPECT_EQ(failed.message, "task 1: FAILED: in.0003.exr: is damaged");
}

// The report is in a folder of the user, who may write anything into it.
TEST_F(Remote, AForgedReportEndsItsJobAlone) {
    open();
    size_t tasks = 0;
    std::string many;
    while (many.size() < 2'000'000) many += ",0";
    using Case = std::tuple<std::string, std::string, std::string>;
    for (const auto& [comparison, variants, verdict] :
         {Case(R"("comparison": {"verdict": 1}, )", "[]", ""),
          {"", R"([1, {"pareto": "yes"}, {"pareto": true}])", "3 variants, 1 in the Pareto set"},
          {R"("comparison": 1, "under": [2], )", "7", ""},
          {"", "[0" + many + "]", ""}}) {
        const std::string id = submit(
            R"({"kind": "ab", "chain": "fast", "chain_b": "paper", "input": "in.####.exr",
                "frames": "1", "output": "report", "on_existing": "overwrite"})");
        ASSERT_TRUE(holds(++tasks));
        write_report(root("report"), queue_->jobs[tasks - 1].log_folder, 0, variants, comparison);
        queue_->end(tasks - 1, 1, 0);
        EXPECT_EQ(done(id).verdict, verdict);
    }
    const std::string id = submit(
        R"({"kind": "ab", "chain": "fast", "chain_b": "paper", "input": "in.####.exr",
            "frames": "1", "output": "report", "on_existing": "overwrite"})");
    ASSERT_TRUE(holds(++tasks));
    write_report(root("report"), queue_->jobs[tasks - 1].log_folder, 0, "[]",
                 R"("comparison": {"verdict": ")" + std::string(1'000'000, 'x') + R"("}, )");
    queue_->end(tasks - 1, 1, 0);
    EXPECT_LE(done(id).verdict.size(), 20'000u) << "lists of jobs have it";
}

TEST_F(Remote, AnAbFailsIfBothChainsDo) {
    open();
    size_t tasks = 0;
    for (const auto& [failure, state] :
         {std::pair("null", JobState::done), {R"("frame 1: none")", JobState::failed}}) {
        const std::string id = submit(
            R"({"kind": "ab", "chain": "fast", "chain_b": "paper", "input": "in.####.exr",
                "frames": "1", "output": "report", "on_existing": "overwrite"})");
        ASSERT_TRUE(holds(++tasks));
        write_report(root("report"), queue_->jobs[tasks - 1].log_folder, 1,
                     concat(R"([{"failure": "frame 1: none"}, {"failure": )", failure, "}]"));
        queue_->end(tasks - 1, 0, 1, "task 1: FAILED");
        EXPECT_EQ(ended(id).state, state) << failure;
    }
}

TEST_F(Remote, AStudyIsAnArrayWithAReportAfterIt) {
    std::ofstream(root("study.yaml")) << "postchain_study: 1\nscenes:\n  - {name: one, input: "
                                         "in.####.exr, truth: in.####.exr, frames: 1-2}\n"
                                         "  - {name: two, input: in.####.exr, truth: in.####.exr, "
                                         "frames: 3-4}\nchains: {x: fast, y: paper}\n";
    open();
    const std::string id = submit(
        R"({"kind": "study", "study": "study.yaml", "output": "made", "on_existing": "overwrite"})");
    ASSERT_TRUE(holds(2));
    EXPECT_THAT(queue_->jobs[0].command, testing::Contains("--on-existing=skip"));
    using Words = std::vector<std::vector<std::string>>;
    EXPECT_EQ(queue_->jobs[0].tasks, (Words{{"--chunk=1/2"}, {"--chunk=2/2"}}));
    EXPECT_EQ(queue_->jobs[1].tasks, Words(1));
    EXPECT_EQ(queue_->jobs[0].command, queue_->jobs[1].command);
    EXPECT_EQ(queue_->jobs[1].after, "1");
    // The next process follows both.
    close();
    open();
    fs::create_directories(root("made/tasks"));
    std::ofstream(root("made/tasks/one.x_vs_y.json")) << "{}";
    std::ofstream(root("made/tasks/two.x_vs_y.claim"));
    EXPECT_TRUE(says(id, "1/2 one.x_vs_y: measured"));
    queue_->end(0, 2, 0);
    usleep(100'000);
    EXPECT_EQ(job(id).state, JobState::running) << "the report is not there";
    const std::string code = queue_->jobs[1].log_folder + "/1.exit";
    std::ofstream(code) << 1;
    queue_->end(1, 0, 1, "task 1: FAILED");
    ASSERT_TRUE(holds(4)) << "both again";
    EXPECT_FALSE(fs::exists(code)) << "of the first attempt";
    EXPECT_TRUE(fs::exists(root("made/tasks/one.x_vs_y.json"))) << "it need not be made again";
    EXPECT_THAT(test::problem_of(service_->forget(user(), id)).detail,
                HasSubstr("cancel it first, and wait until its tasks are canceled too"));
    test::got(service_->cancel(user(), id));
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(queue_->mutex);
        return queue_->canceled == std::vector<std::string>{"4", "3"};
    }));
}

// Its tasks would go on for a job that has failed.
TEST_F(Remote, AStudyWhoseReportIsRefusedCancelsItsTasks) {
    std::ofstream(root("study.yaml"))
        << "postchain_study: 1\nchains: {x: fast, y: paper}\nscenes:\n"
           "  - {name: one, input: in.####.exr, truth: in.####.exr, frames: 1}\n";
    queue_->most = 1;
    open();
    const Job refused = ran(R"({"kind": "study", "study": "study.yaml", "output": "made"})");
    EXPECT_EQ(refused.state, JobState::failed);
    EXPECT_THAT(refused.message, HasSubstr("fake: too many jobs"));
    const std::lock_guard lock(queue_->mutex);
    EXPECT_EQ(queue_->canceled, std::vector<std::string>{"1"});
}

// As the last task has written it, here one that this machine has made before.
TEST_F(Remote, AStudyEndsAsItsReportSays) {
    std::ofstream(root("study.yaml"))
        << "postchain_study: 1\nsettings: {repeats: 1}\nchains: {x: [fxaa], y: [fxaa: {preset: "
           "12}]}\n"
           "scenes:\n  - {name: one, input: in.####.exr, truth: in.####.exr, frames: 1}\n"
           "  - {name: two, input: in.####.exr, truth: none.####.exr, frames: 1}\n";
    const std::string study = R"({"kind": "study", "study": "study.yaml", "output": "made")";
    remote_.queue = nullptr;
    open();
    const Job here = done(submit(study + "}"));
    EXPECT_EQ(here.exit_code, 1);
    EXPECT_THAT(here.message, HasSubstr("scene two: "));
    close();
    remote_.queue = queue_;
    open();
    const std::string id = submit(study + R"(, "on_existing": "skip"})");
    ASSERT_TRUE(holds(2));
    fs::last_write_time(root("made/report.json"),
                        fs::file_time_type::clock::now() + std::chrono::seconds(1));
    std::ofstream(queue_->jobs[1].log_folder + "/1.exit") << 1;
    queue_->end(0, 2, 0);
    queue_->end(1, 0, 1, "task 1: FAILED");
    const Job there = done(id);
    EXPECT_EQ(there.exit_code, 1);
    EXPECT_EQ(there.message, here.message);
    EXPECT_EQ(there.verdict, here.verdict);
}

TEST_F(Remote, OutputsOfAnEarlierJobAreSkipped) {
    remote_.queue = nullptr;
    open();
    done(submit(body(R"(, "frames": "1-2")")));
    close();
    remote_.queue = queue_;
    open();
    const std::string id = submit(body(R"(, "frames": "1-2", "on_existing": "skip")"));
    ASSERT_TRUE(holds(1));
    queue_->end(0, 1, 0);
    EXPECT_EQ(done(id).done, 2);
    for (const JobFrame& frame : frames(id)) EXPECT_EQ(frame.state, FrameState::skipped);
}

// Only those of jobs that need them no more.
TEST_F(Remote, FoldersOfTasksAreCleanedUp) {
    open();
    const std::string failed = submit(body());
    ASSERT_TRUE(holds(1));
    for (int i = 0; i < attempts_; ++i) {
        queue_->end(size_t(i), 0, 2, "task 1: FAILED");
        ASSERT_TRUE(i + 1 == attempts_ || holds(size_t(i) + 2));
    }
    ended(failed);
    const std::string follows = submit(in_folder(body(), "o"));
    ASSERT_TRUE(holds(size_t(attempts_) + 1));
    close();
    for (const char* name : {"77", "notes", "1a"})
        fs::create_directories(remote_.folder + "/" + name + "/in");
    open();
    for (const std::string& name : {failed, follows, std::string("notes"), std::string("1a")})
        EXPECT_TRUE(fs::exists(remote_.folder + "/" + name)) << name;
    EXPECT_FALSE(fs::exists(remote_.folder + "/77")) << "a job that was removed";
}

TEST_F(Remote, TheFolderOfTasksIsClosed) {
    const std::string folder = folder_.path("tasks");
    const std::vector<std::string> roots = {fs::canonical(root()).string()};
    ASSERT_TRUE(take_farm_folder(folder, roots).ok());
    EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
    EXPECT_TRUE(take_farm_folder(folder, roots).ok()) << "again";
    fs::create_symlink(folder, folder_.path("link"));
    EXPECT_THAT(take_farm_folder(folder_.path("link"), roots).message(), HasSubstr("links"));
    fs::permissions(folder, fs::perms::all);
    EXPECT_THAT(take_farm_folder(folder, roots).message(), HasSubstr("0700"));
    EXPECT_EQ(take_farm_folder(root("in.0001.exr/tasks"), roots).code(), StatusCode::output);
    EXPECT_EQ(write_task_file(root("none/chain.yaml"), "").code(), StatusCode::output);
    EXPECT_THAT(take_farm_folder(root("tasks"), roots).message(), HasSubstr("outside of the root"));
    fs::permissions(folder_.path(""), fs::perms::owner_all);
    EXPECT_THAT(take_farm_folder(folder_.path(""), roots).message(),
                HasSubstr("outside of the root"));
}

}  // namespace
}  // namespace postchain::service
