// Jobs in a queue: followed by the lines of their tasks, which these tests write.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "tests/service/schemas.h"
#include "tests/service/support.h"
#include "tests/support/text_file.h"
#include "tools/sequence/files/json.h"
#include "tools/service/work/job_runner.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using test::got;
using test::ServiceTest;
using testing::Contains;
using testing::HasSubstr;
using Tasks = std::vector<std::vector<std::string>>;

// A queue in memory: takes arrays, and ends them when the test says so.
class FakeQueue final : public TaskQueue {
  public:
    std::string name() const override { return "fake"; }
    bool outlives() const override { return lives_on; }
    Result<std::string> submit(const TaskArray& array) override {
        const std::lock_guard lock(mutex);
        ++asked;
        if (!refusal.ok()) return refusal;
        if (arrays.size() >= most) return Status(StatusCode::usage, "fake: too many jobs");
        arrays.push_back(array);
        ranks.push_back(array.rank);
        const std::string id = std::to_string(arrays.size());
        states.push_back({.id = id, .running = int(array.tasks.size()), .message = {}});
        if (loses_answers) return Status(StatusCode::output, "fake: the answer was lost");
        return id;
    }
    Result<std::map<std::string, ArrayState>> look(const std::vector<ArrayName>& names) override {
        for (; hangs; usleep(10'000)) hung = true;
        if (breaks) throw std::runtime_error("fake: is broken");
        const std::lock_guard lock(mutex);
        ++looked;
        if (down) return Status(StatusCode::output, "fake: does not answer");
        std::map<std::string, ArrayState> found;
        for (const ArrayName& one : names)
            for (size_t i = 0; i < arrays.size(); ++i)
                if (arrays[i].name == one.name) found[one.name] = states[i];
        return found;
    }
    Status change(const std::string& id, const TaskRank& rank) override {
        const std::lock_guard lock(mutex);
        if (id == changes_not) throw std::runtime_error("fake: cannot be changed");
        ranks[std::stoul(id) - 1] = rank;
        return Status();
    }
    Status cancel(const std::string& id) override {
        const std::lock_guard lock(mutex);
        canceled.push_back(id);
        if (lives_on) states[std::stoul(id) - 1] = {id, 0, 0, 0, 1, 1, "task 1: CANCELLED"};
        return Status();
    }
    void stop() override { stopped = true; }
    size_t count() {
        const std::lock_guard lock(mutex);
        return arrays.size();
    }
    TaskArray array(size_t i) {
        const std::lock_guard lock(mutex);
        return arrays.at(i);
    }
    // Ends the tasks of array `i`: so many well, so many not.
    void end(size_t i, int done, int failed, const std::string& message = "", int task = 0) {
        const std::lock_guard lock(mutex);
        states[i] = {states[i].id, 0, 0, done, failed, task > 0 ? task : failed, message};
    }
    void refuse(const Status& status) {
        const std::lock_guard lock(mutex);
        refusal = status;
        asked = 0;
    }
    TaskRank rank(size_t i) {
        const std::lock_guard lock(mutex);
        return ranks[i];
    }
    bool has_canceled(const std::vector<std::string>& ids) {
        const std::lock_guard lock(mutex);
        return canceled == ids;
    }
    size_t cancels() {
        const std::lock_guard lock(mutex);
        return canceled.size();
    }

    std::mutex mutex;
    std::vector<TaskArray> arrays;
    std::vector<ArrayState> states;
    std::vector<TaskRank> ranks;
    std::vector<std::string> canceled;
    bool lives_on = true;
    std::atomic<bool> down = false, stopped = false;
    std::atomic<bool> hangs = false, hung = false;  // look()
    std::atomic<bool> breaks = false;               // look() throws
    std::string changes_not;                        // the id for which change() throws
    bool loses_answers = false;                     // of submit(), which takes the array
    Status refusal;                                 // of submit()
    size_t most = 1000;                             // arrays that it takes
    int asked = 0;                                  // submit()
    int looked = 0;
};

class Runner : public ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        fake_ = std::make_shared<FakeQueue>();
        queue_ = fake_;
        remote_.folder = folder_.path("farm");
        remote_.frames_per_task = 4;
        remote_.poll = remote_.idle_poll = std::chrono::milliseconds(20);
        remote_.lag = std::chrono::milliseconds(0);
        program_ = folder_.path("postchain");
        preview_program_ = "false";
        std::ofstream(program_) << "#!/bin/sh\ncase \"$*\" in\n--version) echo postchain test;;\n"
                                   "*--schema) cat "
                                << folder_.path("") << "/$1.schema;;\n*--check*) cat "
                                << folder_.path("") << "/$1.check;;\nesac\n";
        fs::permissions(program_, fs::perms::owner_all);
        for (const auto& [kind, schema] : {std::pair("run", test::kRunSchema),
                                           {"plan", test::kRunSchema},
                                           {"ab", test::kAbSchema},
                                           {"bench", test::kAbSchema},
                                           {"study", test::kStudySchema}})
            std::ofstream(folder_.path(concat(kind, ".schema"))) << schema << "\n";
        finds(6);
        for (const char* kind : {"ab", "study"})
            std::ofstream(folder_.path(concat(kind, ".check"))) << R"({"frames": 2, "writes": []})"
                                                                << "\n";
    }
    // The output of `run --check` with the frames 1..count to be made.
    void finds(int count) const {
        std::ofstream file(folder_.path("run.check"));
        file << R"({"writes": [")" << root("out/o.####.exr") << R"("], "frames": [)";
        for (int frame = 1; frame <= count; ++frame)
            file << (frame > 1 ? ", " : "")
                 << concat(R"({"frame": )", frame, R"(, "output": ")", output(frame), "\"}");
        file << "]}\n";
    }
    std::string output(int frame) const { return root(concat("out/o.000", frame, ".exr")); }
    bool holds(size_t count) {
        return wait_for([&] { return fake_->count() == count; });
    }
    // A task of array `i` prints this line.
    void print(size_t i, const std::string& line, int task = 1) {
        std::ofstream(concat(fake_->array(i).log_folder, "/", task, ".events"), std::ios::app)
            << line << "\n";
    }
    void begins(size_t i, int frame, int task = 1) {
        print(i, concat(R"({"frame": )", frame, R"(, "begins": true})"), task);
    }
    void ends(size_t i, int frame, const std::string& outcome = "written",
              const std::string& more = "", int task = 1) {
        print(i, concat(R"({"frame": )", frame, R"(, "outcome": ")", outcome, "\"", more, "}"),
              task);
    }
    void makes(size_t i, int frame, int task = 1) {
        begins(i, frame, task);
        ends(i, frame, "written", R"(, "bytes": 7, "times_ms": {"filter": 1.5})", task);
    }
    void fails(size_t i, int frame, int task = 1) {
        begins(i, frame, task);
        ends(i, frame, "failed",
             concat(R"(, "error": ")", root(concat("in.000", frame, ".exr")),
                    R"(: is damaged", "error_code": "input")"),
             task);
    }
    void exits(size_t i, int task, int code, const std::string& log = "") {
        const std::string folder = fake_->array(i).log_folder;
        std::ofstream(concat(folder, "/", task, ".exit")) << code << "\n";
        std::ofstream(concat(folder, "/", task, ".log")) << log;
    }
    int attempts_of(const std::string& id, int frame) {
        return got(service_->frame(id, frame)).attempts;
    }
    std::string why(const std::string& id, int frame) {
        return got(service_->frame(id, frame)).message;
    }

    std::shared_ptr<FakeQueue> fake_;
};

TEST_F(Runner, AJobIsHandedOverAndFollowedByItsLines) {
    attempts_ = 3;
    open();
    const std::string id =
        submit(body(R"(, "strict": true, "sidecar": false, "samples": 8, "frame_timeout": 9)"));
    ASSERT_TRUE(holds(1));
    const TaskArray handed = fake_->array(0);
    EXPECT_EQ(handed.tasks, (Tasks{{"--on-existing=resume", "--frames=1-3"},
                                   {"--on-existing=resume", "--frames=4-6"}}));
    EXPECT_EQ(handed.command[0], "postchain");
    EXPECT_EQ(handed.command[1], "run");
    EXPECT_THAT(test::read_text(handed.command[2]), HasSubstr("fxaa"));
    const std::string top = fs::canonical(root()).string();
    for (const std::string& word :
         {std::string("--json"), std::string("--on-error=continue"), std::string("--missing=skip"),
          std::string("--strict"), std::string("--no-sidecar"), std::string("--samples=8"),
          "--confine-to=" + top, "--also-read=" + remote_.folder + "/" + id})
        EXPECT_THAT(handed.command, Contains(word));
    EXPECT_EQ(handed.folder, top) << "relative paths start there";
    EXPECT_EQ(handed.silence_s, 9);
    EXPECT_EQ(handed.name.size(), std::string("postchain-").size() + 32) << "not to be foreseen";
    makes(0, 1);
    ends(0, 2, "held", R"(, "held_from": 1, "warnings": ["a", "b"])");
    begins(0, 4, 2);
    print(0, R"({"remaining_s": 5.5})");
    wait_for_done(id, 2);
    EXPECT_EQ(why(id, 2), "frame 1 is written in its place; a; b");
    EXPECT_TRUE(wait_for([&] { return job(id).remaining_s == 5.5; }));
    // It fails in every attempt; the others are made.
    fails(0, 3);
    for (int frame : {4, 5, 6}) makes(0, frame, 2);
    fake_->end(0, 1, 1, "task 1: FAILED");
    for (size_t attempt = 1; attempt < 3; ++attempt) {
        ASSERT_TRUE(holds(attempt + 1));
        EXPECT_EQ(fake_->array(attempt).tasks, (Tasks{{"--on-existing=resume", "--frames=3"}}));
        EXPECT_NE(fake_->array(attempt).name, handed.name);
        EXPECT_EQ(attempts_of(id, 3), int(attempt));
        fails(attempt, 3);
        fake_->end(attempt, 0, 1, "task 1: FAILED");
    }
    const Job failed = ended(id);
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_THAT(failed.message,
                HasSubstr("1 of 6 frames quarantined: 3; frame 3: in.0003.exr: is damaged"));
    EXPECT_EQ(failed.exit_code, 1) << "some are written";
    EXPECT_EQ(failed.bytes, 4 * 7);
    EXPECT_EQ(fake_->count(), 3u);
    retry(id);
    ASSERT_TRUE(holds(4));
    EXPECT_EQ(attempts_of(id, 3), 0);
    makes(3, 3);
    fake_->end(3, 1, 0);
    EXPECT_EQ(done(id).done, 6);
    EXPECT_TRUE(wait_for([&] { return !fs::exists(remote_.folder + "/" + id); })) << "cleaned up";
}

// Any of several may have ended it: each runs in a task of its own, behind the others.
TEST_F(Runner, TheFrameInFlightIsBlamedForTheDeathOfItsTask) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    makes(0, 1);
    begins(0, 2);
    exits(0, 1, 139, "started\nthe disk of " + fs::canonical(root()).string() + " is full\n");
    for (int frame : {4, 5}) begins(0, frame, 2);
    fake_->end(0, 0, 2, "SIGSEGV");
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(why(id, 2), "SIGSEGV: the disk of . is full");
    for (const auto& [frame, attempts] : {std::pair(2, 1), {3, 0}, {4, 0}, {5, 0}, {6, 0}})
        EXPECT_EQ(attempts_of(id, frame), attempts) << frame;
    EXPECT_EQ(fake_->array(1).tasks, (Tasks{{"--on-existing=resume", "--frames=3,6"},
                                            {"--on-existing=resume", "--frames=2"},
                                            {"--on-existing=resume", "--frames=4"},
                                            {"--on-existing=resume", "--frames=5"}}));
    for (int frame : {3, 6}) makes(1, frame);
    begins(1, 2, 2);
    begins(1, 4, 3);
    makes(1, 5, 4);
    fake_->end(1, 2, 2, "SIGSEGV", 3);
    ASSERT_TRUE(holds(3));
    EXPECT_EQ(attempts_of(id, 4), 1);
    makes(2, 4);
    fake_->end(2, 1, 0);
    EXPECT_THAT(ended(id).message, HasSubstr("1 of 6 frames quarantined: 2; frame 2: SIGSEGV"));
}

TEST_F(Runner, LinesThatAnEarlierProcessReadDoNotCountAgain) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    makes(0, 1);
    fails(0, 2);
    begins(0, 3);
    wait_for_done(id, 1);
    ASSERT_TRUE(wait_for([&] { return attempts_of(id, 2) == 1 && attempts_of(id, 3) == 1; }));
    fake_->down = true;
    close();
    makes(0, 4, 2);
    open();
    ASSERT_TRUE(wait_for([&] { return !service_->health().why.empty(); }));
    EXPECT_EQ(job(id).done, 1);
    fake_->down = false;
    wait_for_done(id, 2);
    EXPECT_EQ(fake_->count(), 1u) << "the same array is followed";
    EXPECT_EQ(attempts_of(id, 2), 1);
    EXPECT_EQ(job(id).failed, 0);
    fails(0, 2);
    EXPECT_TRUE(wait_for([&] { return job(id).failed == 1; }));
    for (int frame : {3, 5, 6}) makes(0, frame);
    fake_->end(0, 2, 0);
    EXPECT_EQ(ended(id).done, 5);
}

// Lines that are printed meanwhile are read later.
TEST_F(Runner, AFolderThatBecomesALinkStopsItsOwnJobAlone) {
    remote_.max_jobs = 1;
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    const std::string next = submit(in_folder(body(), "other"));
    fs::remove_all(root("out"));
    fs::create_symlink(outside(), root("out"));
    // The task finds it while the service runs; another service sees it before.
    close();
    open();
    EXPECT_THAT(ended(id).message, HasSubstr("outside"));
    ASSERT_TRUE(holds(2)) << "the other one has its turn";
    EXPECT_THAT(fake_->array(1).comment, HasSubstr("job " + next));
}

TEST_F(Runner, AStoreThatIsAwayCostsNoFrame) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    begins(0, 1);
    ASSERT_TRUE(wait_for([&] { return attempts_of(id, 1) == 1; }));
    fs::rename(settings().store, folder_.path("away.db"));
    ends(0, 1);
    makes(0, 2);
    EXPECT_TRUE(wait_for([&] {
        return test::count_of(service_->health().why, "the store was removed or replaced") > 0;
    }));
    EXPECT_EQ(refused(in_folder(body(), "next")).kind, Problem::Kind::unavailable);
    usleep(100'000);
    fs::rename(folder_.path("away.db"), settings().store);
    wait_for_done(id, 2);
    for (int frame = 3; frame <= 6; ++frame) makes(0, frame);
    fake_->end(0, 2, 0);
    EXPECT_EQ(done(id).done, 6);
    EXPECT_EQ(fake_->count(), 1u);
}

// More than is read in one poll.
TEST_F(Runner, AllLinesOfAnEndedTaskAreRead) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    const std::string note = R"({"note": ")" + std::string(1000, 'x') + "\"}\n";
    std::string notes;
    while (notes.size() < 9'000'000) notes += note;
    print(0, notes);
    for (int frame = 1; frame <= 6; ++frame) makes(0, frame);
    fake_->end(0, 2, 0);
    EXPECT_EQ(done(id).done, 6);
    EXPECT_EQ(fake_->count(), 1u);
}

// The outputs are in a folder of the user, and a damaged file may have taken over its reader.
TEST_F(Runner, ForgedLinesAreTheirOwnJobsAlone) {
    open();
    const std::string forged = submit(body());
    ASSERT_TRUE(holds(1));
    const std::string id = submit(in_folder(body(), "next"));
    ASSERT_TRUE(holds(2));
    for (const char* line :
         {"no JSON", "[1]", "{", R"({"frame": "1", "outcome": 5})", R"({"frame": 1e99})",
          R"({"frame": 77, "begins": true})", R"({"frame": 78, "outcome": "written"})",
          R"({"frame": 1, "outcome": ["written"], "error": 7})",
          R"({"frame": 2, "outcome": "written", "bytes": "x", "times_ms": 3, "warnings": {}})",
          R"({"frame": 3, "outcome": "skipped", "output": [1]})", R"({"remaining_s": "soon"})"})
        print(0, line);
    print(0, std::string(5'000'000, 'x'));
    fake_->end(0, 2, 0);
    for (int frame = 1; frame <= 6; ++frame) makes(1, frame);
    fake_->end(1, 2, 0);
    EXPECT_EQ(done(id).done, 6);
    EXPECT_TRUE(wait_for([&] { return holds(3) && attempts_of(forged, 1) == 1; }));
}

TEST_F(Runner, AnExceptionOfOneJobEndsThatJobAlone) {
    open();
    const std::string breaks = submit(body());
    ASSERT_TRUE(holds(1));
    const std::string id = submit(in_folder(body(), "o"));
    ASSERT_TRUE(holds(2));
    {
        const std::lock_guard lock(fake_->mutex);
        fake_->changes_not = "1";
    }
    for (const std::string& one : {breaks, id})
        got(service_->change(user(), one, R"({"priority": 50})"));
    EXPECT_EQ(ended(breaks).state, JobState::failed);
    EXPECT_THAT(job(breaks).message, HasSubstr("fake: cannot be changed"));
    EXPECT_TRUE(wait_for([&] { return fake_->has_canceled({"1"}); })) << "its tasks";
    EXPECT_TRUE(wait_for([&] { return fake_->rank(1).priority == 50; }));
    EXPECT_EQ(job(id).state, JobState::running);
}

TEST_F(Runner, ARefusedJobFailsAndOneWithoutAnswerWaits) {
    fake_->refusal = Status(StatusCode::output, "fake: does not answer");
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(wait_for([&] {
        const std::lock_guard lock(fake_->mutex);
        return fake_->asked > 2 * attempts_;
    }));
    EXPECT_EQ(job(id).state, JobState::running);
    EXPECT_THAT(service_->health().why, HasSubstr("fake: does not answer"));
    fake_->refuse(Status());
    ASSERT_TRUE(holds(1));
    fake_->refuse(Status(StatusCode::usage, "fake: invalid partition"));
    const Job refused = ran(in_folder(body(), "next"));
    EXPECT_EQ(refused.state, JobState::failed);
    EXPECT_THAT(refused.message, HasSubstr("fake: invalid partition"));
    EXPECT_EQ(fake_->asked, attempts_);
}

// As after the death of a process between its submission and its note of it.
TEST_F(Runner, AnArrayThatTheQueueHasIsNotHandedOverAgain) {
    fake_->loses_answers = true;
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    for (int frame = 1; frame <= 6; ++frame) makes(0, frame);
    wait_for_done(id, 6);
    fake_->end(0, 2, 0);
    done(id);
    EXPECT_EQ(fake_->count(), 1u);
}

TEST_F(Runner, TasksThatDoNothingEndTheirJob) {
    open();
    // A fault that another attempt does not mend.
    const std::string bad = submit(body());
    ASSERT_TRUE(holds(1));
    exits(0, 1, 3, "error: chain.yaml:2:1: no pass\n\n");
    fake_->end(0, 0, 2, "exit code 3", 1);
    EXPECT_EQ(ended(bad).exit_code, 3);
    EXPECT_EQ(job(bad).message, "exit code 3: chain.yaml:2:1: no pass");
    // Others are tried as often, and after a retry again.
    const std::string id = submit(in_folder(body(), "next"));
    for (size_t arrays = 2; arrays <= 5; ++arrays) {
        ASSERT_TRUE(holds(arrays));
        fake_->end(arrays - 1, 0, 2, "NODE_FAIL");
        if (arrays % 2 == 0) continue;
        EXPECT_EQ(ended(id).state, JobState::failed);
        EXPECT_THAT(job(id).message, HasSubstr("NODE_FAIL"));
        if (arrays == 3) retry(id);
    }
    EXPECT_EQ(fake_->count(), 5u);
}

TEST_F(Runner, ACanceledJobCancelsItsTasks) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    begins(0, 1);
    const Job canceled = got(service_->cancel(user(), id));
    EXPECT_EQ(canceled.exit_code, 143) << "as of the command after SIGTERM";
    EXPECT_TRUE(wait_for([&] { return fake_->has_canceled({"1"}); }));
    EXPECT_TRUE(wait_for([&] { return !fs::exists(remote_.folder + "/" + id); }));
    retry(id);
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(attempts_of(id, 1), 0);
}

TEST_F(Runner, OnErrorStopEndsAtTheFirstQuarantinedFrame) {
    attempts_ = 1;
    open();
    const std::string id = submit(body(R"(, "on_error": "stop")"));
    ASSERT_TRUE(holds(1));
    makes(0, 1);
    fails(0, 2);
    const Job failed = ended(id);
    EXPECT_TRUE(fake_->has_canceled({"1"}));
    EXPECT_EQ(failed.state, JobState::failed);
    EXPECT_EQ(failed.exit_code, 1);
    EXPECT_EQ(failed.message,
              "in.0002.exr: is damaged; 4 frames left; a retry continues with them");
}

TEST_F(Runner, ALimitOfTheDiskCancelsTheTasks) {
    use("  ann: {token: aaaaaaaaaaaaaaaa, max_disk: \"5\"}\n");
    remote_.max_jobs = 1;
    open();
    const std::string id = submit(body(), "ann");
    const std::string waiting = submit(in_folder(body(), "other"), "ann");
    ASSERT_TRUE(holds(1));
    std::ofstream(output(1)) << "1234567";
    makes(0, 1);
    EXPECT_THAT(ended(id).message, HasSubstr("max_disk: the jobs of ann have written"));
    EXPECT_EQ(job(id).done, 1);
    EXPECT_TRUE(fake_->has_canceled({"1"}));
    EXPECT_THAT(ended(waiting).message, HasSubstr("max_disk"));
    EXPECT_EQ(fake_->count(), 1u) << "it is not handed over";
}

TEST_F(Runner, TheLastFrameMayFillTheDisk) {
    use("  ann: {token: aaaaaaaaaaaaaaaa, max_disk: \"5\"}\n");
    finds(1);
    open();
    const std::string id = submit(body(), "ann");
    ASSERT_TRUE(holds(1));
    std::ofstream(output(1)) << "1234567";
    makes(0, 1);
    ASSERT_TRUE(wait_for([&] { return job(id).done == 1; }));
    const int looked = fake_->looked;
    ASSERT_TRUE(wait_for([&] { return fake_->looked > looked + 2; }));
    fake_->end(0, 1, 0);
    EXPECT_EQ(ended(id).state, JobState::done);
}

// Frames to do would look otherwise than those that are done.
TEST_F(Runner, AnEditedFileMixesNoFrames) {
    open();
    for (const std::string edited : {"chain.yaml", "camera.json", ""}) {
        for (const char* name : {"chain.yaml", "camera.json"}) {
            std::ofstream(root(name)) << "x";
            fs::last_write_time(root(name),
                                fs::file_time_type::clock::now() - std::chrono::seconds(60));
        }
        const size_t arrays = fake_->count();
        const std::string id = submit(
            R"({"chain": "./chain.yaml", "camera": "camera.json", "input": "in.####.exr",
                "output": "out/o.####.exr", "on_existing": "overwrite"})");
        ASSERT_TRUE(holds(arrays + 1));
        EXPECT_EQ(fake_->array(arrays).tasks[0][0], "--on-existing=skip") << "it may run twice";
        makes(arrays, 1);
        wait_for_done(id, 1);
        if (!edited.empty()) std::ofstream(root(edited)) << "y";
        fake_->end(arrays, 0, 2, "NODE_FAIL");
        if (edited.empty()) {
            EXPECT_TRUE(holds(arrays + 2));
            continue;
        }
        EXPECT_EQ(ended(id).state, JobState::failed);
        EXPECT_THAT(job(id).message, testing::StartsWith(edited + ": the "));
        EXPECT_THAT(job(id).message, HasSubstr("was changed after frames were made with it; "
                                               "submit the job again, with on_existing: skip"));
    }
}

// ---------------------------------------------------------------------- tasks of this machine
class Here : public Runner {
  protected:
    void SetUp() override {
        Runner::SetUp();
        fake_->lives_on = false;
        drain_ = std::chrono::seconds(1);  // its tasks end when a test says so, or not at all
        remote_.max_jobs = 1;
        remote_.frames_per_task = 0;
    }
    // The task of array `i` ends, as it does after SIGTERM.
    void leaves(size_t i) {
        ASSERT_TRUE(wait_for([&] { return fake_->cancels() > 0; }));
        fake_->end(i, 0, 1, "SIGTERM");
    }
};

TEST_F(Here, AJobMakesWayForALargerPriority) {
    open();
    const std::string slow = submit(body(R"(, "on_existing": "overwrite")"));
    ASSERT_TRUE(holds(1));
    EXPECT_EQ(fake_->array(0).tasks, (Tasks{{"--on-existing=overwrite", "--frames=1-6"}}));
    makes(0, 1);
    begins(0, 2);
    wait_for_done(slow, 1);
    const std::string equal = submit(in_folder(body(), "equal"));
    const std::string urgent = submit(in_folder(body(R"(, "priority": 9)"), "first"));
    leaves(0);
    ASSERT_TRUE(holds(2));
    EXPECT_THAT(fake_->array(1).comment, HasSubstr("job " + urgent));
    EXPECT_EQ(job(slow).state, JobState::queued);
    EXPECT_EQ(attempts_of(slow, 2), 0);
    EXPECT_EQ(events(slow).back().data, R"({"why":"another job goes first"})");
    for (int frame = 1; frame <= 6; ++frame) makes(1, frame);
    fake_->end(1, 1, 0);
    done(urgent);
    ASSERT_TRUE(holds(3));
    EXPECT_THAT(fake_->array(2).comment, HasSubstr("job " + slow));
    EXPECT_EQ(fake_->array(2).tasks, (Tasks{{"--on-existing=overwrite", "--frames=2-6"}}));
}

TEST_F(Here, AfterASliceItIsAnotherUsersTurn) {
    use("  ann: {token: aaaaaaaaaaaaaaaa}\n  bob: {token: bbbbbbbbbbbbbbbb}\n");
    remote_.slice_s = 0.3;
    open();
    const std::string first = submit(body(), "ann");
    ASSERT_TRUE(holds(1));
    submit(in_folder(body(), "second"), "ann");
    usleep(500'000);
    EXPECT_EQ(fake_->cancels(), 0u) << "for a job of the same user";
    submit(in_folder(body(), "bobs"), "bob");
    begins(0, 1);
    usleep(500'000);
    EXPECT_EQ(fake_->cancels(), 0u) << "no frame has ended: both jobs would begin again and again";
    ends(0, 1);
    leaves(0);
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(fake_->array(1).owner, "bob");
    // An ab would lose what it has measured.
    for (int frame = 1; frame <= 6; ++frame) makes(1, frame);
    fake_->end(1, 1, 0);
    ASSERT_TRUE(holds(3));
    got(service_->cancel(user("ann"), "2"));
    got(service_->cancel(user("ann"), first));
    fake_->end(2, 0, 1, "SIGTERM");
    submit(R"({"kind": "ab", "chain": "fast", "chain_b": "best", "input": "in.####.exr",
               "output": "report"})",
           "ann");
    ASSERT_TRUE(holds(4));
    const size_t cancels = fake_->cancels();
    submit(in_folder(body(), "bobs2"), "bob");
    usleep(500'000);
    EXPECT_EQ(fake_->cancels(), cancels);
}

// The end of the service counts no attempt.
TEST_F(Here, JobsGoOnInTheNextProcess) {
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    makes(0, 1);
    begins(0, 2);
    wait_for_done(id, 1);
    std::thread ends([&] { leaves(0); });
    service_->drain();
    ends.join();
    EXPECT_EQ(job(id).state, JobState::queued);
    EXPECT_EQ(events(id).back().data, R"({"why":"stopped"})");
    EXPECT_EQ(refused(body()).kind, Problem::Kind::unavailable);
    close();
    open();
    ASSERT_TRUE(holds(2));
    EXPECT_EQ(attempts_of(id, 2), 0);
    EXPECT_EQ(fake_->array(1).tasks, (Tasks{{"--on-existing=resume", "--frames=2-6"}}));
}

// --------------------------------------------------------------------------- the queue itself
TEST_F(Runner, AQueueThatHangsIsNotWaitedFor) {
    drain_ = std::chrono::milliseconds(100);
    open();
    submit(body());
    ASSERT_TRUE(holds(1));
    fake_->hangs = true;
    ASSERT_TRUE(wait_for([&] { return fake_->hung.load(); }));
    service_->drain();
    EXPECT_THAT(service_->health().why, HasSubstr("1 thread hangs"));
    EXPECT_EQ(service_->end(), 1u);
    EXPECT_TRUE(fake_->stopped);
    fake_->hangs = false;
    EXPECT_TRUE(wait_for([&] { return service_->end() == 0; })) << "the thread has ended";
}

TEST_F(Runner, AQueueThatIsSilentOrBrokenIsSeen) {
    remote_.silence = std::chrono::milliseconds(300);
    open();
    const auto progress = [&](bool has) {
        return wait_for([&] { return service_->health().progress == has; });
    };
    EXPECT_TRUE(progress(true));
    fake_->down = true;
    ASSERT_TRUE(progress(false));
    EXPECT_TRUE(wait_for([&] {
        return service_->health().why.find("fake has not answered for") != std::string::npos;
    }));
    EXPECT_TRUE(service_->alive()) << "a restart does not help";
    fake_->down = false;
    EXPECT_TRUE(progress(true));
    fake_->breaks = true;
    ASSERT_TRUE(wait_for(
        [&] { return service_->health().why.find("fake: is broken") != std::string::npos; }));
    fake_->breaks = false;
    EXPECT_TRUE(progress(true));
}

TEST_F(Runner, JobsWaitForRoomInTheOrderOfTheService) {
    use("  ann: {token: aaaaaaaaaaaaaaaaaaaa, max_priority: 100}\n"
        "  bob: {token: bbbbbbbbbbbbbbbbbbbb, max_priority: 100}\n");
    remote_.max_jobs = 3;
    remote_.max_jobs_of_user = 2;
    remote_.max_tasks = 6;
    remote_.poll = std::chrono::milliseconds(100);
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
    EXPECT_TRUE(wait_for([&] { return fake_->rank(0).most_tasks == 3; }));
    next("bob", R"(, "priority": 7)");
    ASSERT_TRUE(holds(3));
    EXPECT_EQ(fake_->array(2).owner, "bob");
    EXPECT_THAT(fake_->array(2).comment, HasSubstr("job 4 of bob"));
    // Each user has half of the tasks, ann's jobs a quarter and a half of it.
    EXPECT_TRUE(wait_for([&] {
        return fake_->rank(0).most_tasks == 1 && fake_->rank(1).most_tasks == 1 &&
               fake_->rank(2) == TaskRank{7, 3};
    }));
    next("bob");
    EXPECT_THAT(refused(in_folder(body(), "o6"), "bob").detail, HasSubstr("2 jobs are waiting"));
    EXPECT_EQ(fake_->count(), 3u);
    // A job in the queue, and one that waits, get another priority.
    got(service_->change(user("ann"), "1", R"({"priority": 50})"));
    EXPECT_TRUE(wait_for([&] { return fake_->rank(0).priority == 50; }));
    got(service_->change(user("ann"), third, R"({"priority": 40})"));
    got(service_->cancel(user("ann"), "2"));
    ASSERT_TRUE(holds(4));
    EXPECT_EQ(fake_->array(3).owner, "ann");
    EXPECT_EQ(fake_->array(3).rank.priority, 40);
    // One call for all jobs.
    const int looked = fake_->looked;
    usleep(500'000);
    EXPECT_LT(fake_->looked - looked, 10);
}

// The lines appear on this machine some time after their task has ended.
TEST_F(Runner, LinesMayComeLateOverNfs) {
    remote_.lag = std::chrono::seconds(60);
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(holds(1));
    for (int frame = 1; frame <= 5; ++frame) makes(0, frame);
    begins(0, 6);
    fake_->end(0, 2, 0);
    wait_for_done(id, 5);
    usleep(200'000);
    EXPECT_EQ(job(id).state, JobState::running);
    ends(0, 6);
    done(id);
    EXPECT_EQ(fake_->count(), 1u);
}

// ------------------------------------------------------------------------- ab, bench and study
class Measures : public Runner {
  protected:
    std::string ab(const std::string& kind = "ab") {
        return submit(concat(R"({"kind": ")", kind, R"(", "chain": "fast", "chain_b": "best",
            "input": "in.####.exr", "output": ")",
                             "report", fake_->count(), R"("})"));
    }
    // "done/total what" of all events of progress.
    std::string told(const std::string& id) {
        std::string all;
        for (const Event& event : events(id)) {
            if (event.type != "progress") continue;
            const auto data = io::Json::parse(event.data);
            all += concat(data["done"].get<int>(), "/", data["total"].get<int>(), " ",
                          data["what"].get<std::string>(), "\n");
        }
        return all;
    }
};

TEST_F(Measures, EndAsTheirLastLineSays) {
    open();
    const std::string id = ab();
    ASSERT_TRUE(holds(1));
    EXPECT_EQ(fake_->array(0).tasks, Tasks(1));
    EXPECT_THAT(fake_->array(0).command, Contains("--on-existing=overwrite")) << "anew";
    const std::string top = fs::canonical(root()).string();
    print(0, concat(R"({"what": "frame 1 of )", top, R"(, fast", "done": 1, "total": 6})"));
    ASSERT_TRUE(wait_for([&] { return told(id) == "1/6 frame 1 of ., fast\n"; }));
    usleep(100'000);
    EXPECT_EQ(told(id), "1/6 frame 1 of ., fast\n") << "it says each once";
    // A node dies: another attempt. Then it exceeds a limit, and has written its report.
    fake_->end(0, 0, 1, "task 1: NODE_FAIL");
    ASSERT_TRUE(holds(2));
    fs::create_directory(root("report0"));
    std::ofstream(root("report0/report.json")) << "1234567";
    print(1, concat(R"({"verdict": "A is closer", "exit_code": 8, "message": "over )", top,
                    R"(/x"})"));
    exits(1, 1, 8);
    fake_->end(1, 0, 1, "task 1: FAILED");
    const Job done = ended(id);
    EXPECT_EQ(done.state, JobState::done);
    EXPECT_EQ(done.exit_code, 8);
    EXPECT_EQ(done.verdict, "A is closer");
    EXPECT_EQ(done.message, "over x");
    EXPECT_EQ(done.bytes, 7);
    // Both chains have failed.
    const std::string both = ab();
    ASSERT_TRUE(holds(3));
    print(2, R"({"verdict": "", "exit_code": 1, "message": "a; b", "failed": true})");
    fake_->end(2, 0, 1, "task 1: FAILED");
    EXPECT_EQ(ended(both).state, JobState::failed);
    // A fault that no other attempt mends.
    const std::string bad = ab();
    ASSERT_TRUE(holds(4));
    exits(3, 1, 4, "in.0003.exr: is damaged\n\n");
    fake_->end(3, 0, 1, "task 1: FAILED");
    EXPECT_EQ(ended(bad).exit_code, 4);
    EXPECT_EQ(job(bad).message, "task 1: FAILED: in.0003.exr: is damaged");
    // Forged.
    const std::string forged = ab();
    ASSERT_TRUE(holds(5));
    print(4, R"({"verdict": 1, "exit_code": "x", "message": [], "failed": "no", "what": {}})");
    fake_->end(4, 1, 0);
    EXPECT_EQ(ended(forged).verdict, "");
}

TEST_F(Measures, AStudyInAQueueIsAnArrayWithAReportAfterIt) {
    open();
    const std::string id = submit(
        R"({"kind": "study", "study": "./s.yaml", "output": "made", "on_existing": "overwrite"})");
    ASSERT_TRUE(holds(2));
    const TaskArray chunks = fake_->array(0), report = fake_->array(1);
    EXPECT_EQ(chunks.tasks, (Tasks{{"--chunk=1/2"}, {"--chunk=2/2"}}));
    EXPECT_THAT(chunks.command, Contains("--on-existing=skip"));
    EXPECT_EQ(report.tasks, Tasks(1));
    EXPECT_EQ(report.command, chunks.command);
    EXPECT_EQ(report.after, "1");
    // The next process follows both.
    close();
    open();
    print(0, R"({"what": "one.x_vs_y", "done": 1, "total": 2})", 2);
    EXPECT_TRUE(wait_for([&] { return told(id) == "1/2 one.x_vs_y\n"; }));
    fake_->end(0, 2, 0);
    usleep(100'000);
    EXPECT_EQ(job(id).state, JobState::running) << "the report is not there";
    exits(1, 1, 1);
    fake_->end(1, 0, 1, "task 1: FAILED");
    ASSERT_TRUE(holds(4)) << "both again";
    fake_->end(2, 2, 0);
    print(3, R"({"verdict": "two scenes", "exit_code": 1, "message": "scene two: none"})");
    fake_->end(3, 0, 1, "task 1: FAILED");
    EXPECT_EQ(done(id).verdict, "two scenes");
    EXPECT_EQ(fake_->count(), 4u);
    const std::string canceled =
        submit(R"({"kind": "study", "study": "./s.yaml", "output": "more"})");
    ASSERT_TRUE(holds(6));
    got(service_->cancel(user(), canceled));
    EXPECT_TRUE(wait_for([&] { return fake_->has_canceled({"6", "5"}); }));
}

// Its tasks would go on for a job that has failed.
TEST_F(Measures, AStudyWhoseReportIsRefusedCancelsItsTasks) {
    fake_->most = 1;
    open();
    const Job refused = ran(R"({"kind": "study", "study": "./s.yaml", "output": "made"})");
    EXPECT_EQ(refused.state, JobState::failed);
    EXPECT_THAT(refused.message, HasSubstr("fake: too many jobs"));
    EXPECT_TRUE(fake_->has_canceled({"1"}));
}

// --------------------------------------------------------------------------- folders of jobs
// Only those of jobs that need them no more.
TEST_F(Runner, FoldersOfJobsAreCleanedUp) {
    attempts_ = 1;
    open();
    const std::string failed = submit(body());
    ASSERT_TRUE(holds(1));
    fake_->end(0, 0, 2, "task 1: FAILED");
    ended(failed);
    const std::string follows = submit(in_folder(body(), "o"));
    ASSERT_TRUE(holds(2));
    close();
    for (const char* name : {"77", "notes", "1a"})
        fs::create_directories(remote_.folder + "/" + name + "/in");
    open();
    for (const std::string& name : {failed, follows, std::string("notes"), std::string("1a")})
        EXPECT_TRUE(fs::exists(remote_.folder + "/" + name)) << name;
    EXPECT_FALSE(fs::exists(remote_.folder + "/77")) << "a job that was removed";
}

TEST_F(Runner, TheFolderOfJobsIsClosed) {
    const std::string folder = folder_.path("tasks");
    const std::vector<std::string> roots = {fs::canonical(root()).string()};
    ASSERT_TRUE(take_private_folder(folder, roots).ok());
    EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
    EXPECT_TRUE(take_private_folder(folder, roots).ok()) << "again";
    fs::create_symlink(folder, folder_.path("link"));
    EXPECT_THAT(take_private_folder(folder_.path("link"), roots).message(), HasSubstr("links"));
    fs::permissions(folder, fs::perms::all);
    EXPECT_THAT(take_private_folder(folder, roots).message(), HasSubstr("0700"));
    EXPECT_EQ(take_private_folder(root("in.0001.exr/tasks"), roots).code(), StatusCode::output);
    EXPECT_THAT(take_private_folder(root("tasks"), roots).message(),
                HasSubstr("outside of the root"));
    fs::permissions(folder_.path(""), fs::perms::owner_all);
    EXPECT_THAT(take_private_folder(folder_.path(""), roots).message(),
                HasSubstr("outside of the root"));
}

}  // namespace
}  // namespace postchain::service
