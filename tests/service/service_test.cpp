// The whole service with its programs: what the transcripts beside this file cannot show.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/job_files.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::got;
using test::problem_of;
using test::write_text;
using testing::HasSubstr;
using testing::Not;

// Takes jobs, which never end.
class BusyQueue final : public TaskQueue {
  public:
    std::string name() const override { return "busy"; }
    Result<std::string> submit(const TaskArray& array) override { return array.name; }
    Result<std::map<std::string, ArrayState>> look(const std::vector<ArrayName>& names) override {
        std::map<std::string, ArrayState> states;
        for (const ArrayName& one : names)
            if (!one.id.empty()) states[one.name] = {.id = one.id, .running = 1, .message = {}};
        return states;
    }
    Status change(const std::string&, const TaskRank&) override { return Status(); }
    Status cancel(const std::string&) override { return Status(); }
};

class Jobs : public test::ServiceTest {
  protected:
    Jobs() {
        program_ = POSTCHAIN_PROGRAM;
        preview_program_ = POSTCHAIN_PREVIEW;
        version_ = POSTCHAIN_VERSION;
    }
    void open_busy() {
        queue_ = std::make_shared<BusyQueue>();
        remote_.folder = folder_.path("farm");
        remote_.max_jobs = 1;
        remote_.poll = std::chrono::milliseconds(20);
        open();
    }
    std::string out(int frame) const { return root(concat("out/o.000", frame, ".exr")); }
    // An ab of two frames with its report in this folder.
    static std::string ab(const std::string& output, const std::string& more = "") {
        return concat(R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1-2",
            "repeats": 1, "page_frames": 1, "output": ")",
                      output, "\"", more, "}");
    }
};

// The service died during the job: the outputs are checked frame by frame.
TEST_F(Jobs, AStrangersFileThatCameAfterTheStartStaysToo) {
    open();
    ASSERT_EQ(done(submit(body())).done, 6);
    const std::string good = test::read_text(out(2));
    close();
    {
        // The state after a kill: 1 and 2 were in flight, 2 was written, 1 was not. Since then
        // another program has written an output 1.
        const auto store = test::must(JobStore::open(settings().store, 2));
        const std::string again = store->add({JobKind::run, body()}, 10)->job.id;
        ASSERT_TRUE(*store->start(again));
        std::vector<JobFrame> frames(2);
        for (int i : {0, 1}) {
            frames[size_t(i)].frame = i + 1;
            frames[size_t(i)].output = out(i + 1);
        }
        ASSERT_TRUE(store->enter_frames(again, frames).ok());
        for (int frame : {1, 2}) ASSERT_TRUE(store->frame_begins(again, frame).ok());
        write_text(out(1), "a stranger's");
    }
    const auto time = fs::last_write_time(out(2));
    open();
    EXPECT_EQ(ended("2").state, JobState::failed);
    EXPECT_EQ(frames("2")[0].state, FrameState::quarantined);
    EXPECT_THAT(frames("2")[0].message, HasSubstr("exists"));
    EXPECT_EQ(test::read_text(out(1)), "a stranger's");
    EXPECT_EQ(job("2").done, 1);
    EXPECT_FALSE(got(service_->frame("2", 2)).sidecar.empty());
    EXPECT_EQ(test::read_text(out(2)), good);
    EXPECT_EQ(fs::last_write_time(out(2)), time) << "was written again";
}

// Refused before it is queued, unless it says what becomes of them.
TEST_F(Jobs, OutputsThatExistOrThatAnotherJobWillWrite) {
    const auto why = [this](const std::string& body) {
        const Problem problem = refused(body);
        EXPECT_EQ(problem.kind, Problem::Kind::invalid);
        EXPECT_EQ(problem.diagnostics.at(0).path, "on_existing");
        EXPECT_THAT(problem.detail, Not(HasSubstr(root())));
        return problem.detail;
    };
    write_text(out(4), "mine");
    fs::create_symlink("nowhere", out(5));
    open_busy();
    for (const char* more : {"", R"(, "on_existing": "fail")"})
        EXPECT_THAT(why(body(more)), HasSubstr("out/o.0004.exr"));
    // A job that runs, and one that waits.
    const std::string runs = submit(body(R"(, "frames": "3")"));
    EXPECT_THAT(why(body(R"(, "frames": "2-3")")),
                HasSubstr(concat("job ", runs, " is going to write frame 3 to the same file")));
    submit(body(R"(, "frames": "2")"));  // another frame
    EXPECT_THAT(why(body(R"(, "frames": "2")")), HasSubstr("frame 2 to the same file"));
    submit(ab("report"));
    EXPECT_THAT(why(ab("out/../report")), HasSubstr("is going to write this report"));
    submit(body(R"(, "on_existing": "overwrite")"));
}

TEST_F(Jobs, KeysAndAFullQueue) {
    max_queue_ = 1;
    use("  ann: {token: a234567890123456}\n  ben: {token: b543210987654321}\n");
    open_busy();
    const std::string first = submit(body(), "ann");
    ASSERT_TRUE(wait_for([&] { return job(first).state == JobState::running; }));
    const std::string next = in_folder(body(), "next"), key(255, 'k');
    const auto with_key = [&](const std::string& text, bool is_new, const char* name = "ann") {
        bool created = !is_new;
        auto answer = service_->submit(user(name), text, key, &created);
        EXPECT_EQ(created, is_new);
        return answer;
    };
    const Job waits = got(with_key(next, true));
    EXPECT_EQ(waits.place, 1);
    // Keys are their user's own: this is another job.
    const Problem full = problem_of(with_key(in_folder(body(), "bens"), false, "ben"));
    EXPECT_EQ(full.kind, Problem::Kind::busy);
    EXPECT_GT(full.retry_after_s, 0);
    // Also with a full queue, and if its files have been removed since.
    fs::remove(root("in.0001.exr"));
    EXPECT_EQ(got(with_key(next, false)).id, waits.id);
    EXPECT_EQ(problem_of(with_key(next + " ", false)).kind, Problem::Kind::conflict);
    EXPECT_TRUE(wait_for([&] { return !service_->health().queue; }));
    // A retry waits for room too.
    got(service_->cancel(user("ann"), waits.id));
    const std::string other = submit(in_folder(body(), "other"), "ann");
    EXPECT_EQ(problem_of(service_->retry(user("ann"), waits.id)).kind, Problem::Kind::busy);
    got(service_->cancel(user("ann"), other));
    EXPECT_EQ(got(service_->retry(user("ann"), waits.id)).state, JobState::queued);
}

// All files count for max_disk, and the frames of measurements for max_frames.
TEST_F(Jobs, WhatItWritesAndMeasuresIsCounted) {
    open();
    const auto size = [&](const fs::path& folder) {
        int64_t sum = 0;
        for (const auto& entry : fs::recursive_directory_iterator(folder))
            if (entry.is_regular_file()) sum += int64_t(entry.file_size());
        return sum;
    };
    const auto inputs = size(root());
    const Job run = done(submit(body(R"(, "dump_stages": "stages", "png": true)")));
    EXPECT_EQ(run.bytes, size(root()) - inputs);
    const Job measured = done(submit(ab("report")));
    EXPECT_EQ(measured.frames, 2);
    EXPECT_EQ(measured.done, 2);
    EXPECT_EQ(measured.bytes, size(root("report")));
    EXPECT_FALSE(measured.verdict.empty());
}

TEST_F(Jobs, BenchAndStudyRunToo) {
    open();
    EXPECT_THAT(done(submit(R"({"kind": "bench", "chain": {"postchain": 1, "passes": ["fxaa"]},
                    "input": "in.####.exr", "frames": "3", "output": "bench", "repeats": 1,
                    "split_frames": 0, "sweep": ["fxaa.preset=12,39"]})"))
                    .verdict,
                HasSubstr("2 variants"));
    const Job study = done(submit(
        R"({"kind": "study", "output": "study", "study": {"postchain_study": 1,
            "chains": {"x": ["fxaa"], "y": []}, "settings": {"repeats": 1},
            "scenes": [{"name": "a", "input": "in.####.exr", "frames": "1", "truth": "in.####.exr"},
                       {"name": "b", "input": "in.####.exr", "frames": "1", "truth": "no.####.exr"}]}})"));
    EXPECT_EQ(study.exit_code, 1);
    EXPECT_THAT(study.message, HasSubstr("scene b: "));
    EXPECT_THAT(study.message + test::read_text(root("study/report.json")), Not(HasSubstr(root())));
    got(service_->report_file(user(), study.id, "scenes/a/x_vs_y/index.html"));
}

TEST_F(Jobs, AFolderThatBecomesALinkIsNotFollowed) {
    // A folder when the job is submitted, a link when it runs.
    test::must(test::must(JobStore::open(settings().store, 2))
                   ->add({JobKind::run, in_folder(body(), "turn")}, 10));
    fs::remove(root("turn"));
    fs::create_directory_symlink(outside(), root("turn"));
    open();
    EXPECT_EQ(ended("1").state, JobState::failed);
    EXPECT_TRUE(fs::is_empty(outside()));
}

TEST_F(Jobs, HealthSaysWhatIsWrong) {
    open();
    ASSERT_TRUE(wait_for([&] { return service_->health().gl; })) << service_->health().why;
    const Health health = service_->health();
    EXPECT_TRUE(health.disk && health.queue && health.progress) << health.why;
    EXPECT_FALSE(health.renderer.empty());
    fs::remove_all(root());
    EXPECT_TRUE(wait_for([&] { return !service_->health().disk; }));
    EXPECT_NE(service_->health().why, "");
}

// ------------------------------------------------------------------------------------ results
TEST_F(Jobs, FilesHaveTheTypeOfTheirName) {
    const Roots roots = test::must(Roots::of({root("")}));
    std::vector<JobFrame> frames;
    for (const char* name : {"a.0003.exr", "a.0004.png", "a.0005.dpx", "a.0006.EXR"}) {
        write_text(root(name), concat("picture ", name));
        frames.push_back(
            {.frame = int(frames.size()) + 3, .state = FrameState::written, .output = root(name)});
    }
    frames[3].state = FrameState::quarantined;
    std::string text;
    for (size_t i = 0; i < 3; ++i) {
        const ResultFile file = got(output_of(frames[i], roots));
        text += concat(file.name, " ", file.type, " ", file.bytes, "\n");
    }
    EXPECT_EQ(text,
              "a.0003.exr image/x-exr 18\na.0004.png image/png 18\n"
              "a.0005.dpx application/octet-stream 18\n");
    EXPECT_EQ(problem_of(output_of(frames[3], roots)).kind, Problem::Kind::not_found);
}

TEST_F(Jobs, BytesOfWhatIsWritten) {
    size_t bytes = 1;
    for (const char* name : {"out/one.exr", "out/one.exr.json", "out/one.exr.png", "out/f.0001.exr",
                             "out/f.0001.exr.json", "out/f.0001.exr.png", "out/g.0001.exr"})
        write_text(root(name), std::string(std::exchange(bytes, 2 * bytes), 'x'));
    // Neither what a link leads to nor a folder is of the job.
    write_text(root("large"), std::string(10'000, 'x'));
    for (const char* link : {"out/f.0002.exr", "out/link"})
        fs::create_symlink(root("large"), root(link));
    fs::create_directory(root("out/f.0003.exr"));
    EXPECT_EQ(bytes_on_disk(root("out/one.exr")), 1 + 2 + 4);
    EXPECT_EQ(bytes_on_disk(root("out/f.####.exr")), 8 + 16 + 32);
    EXPECT_EQ(bytes_on_disk(root("out")), 127);
    EXPECT_EQ(bytes_on_disk(root("out/one.exr") + "\n" + root("out/g.####.exr")), 7 + 64);
    EXPECT_EQ(bytes_on_disk(root("out/none.exr")), 0);
}

TEST_F(Jobs, ImagesAndPreviewsHaveALimitOfMemory) {
    max_memory_ = 40'000;  // a quarter for a preview, an eighth for each of two images
    open();
    const Problem large = no_picture(
        [&](auto done) { service_->input_image(user(), "in.####.exr", 1, {}, std::move(done)); });
    EXPECT_EQ(large.kind, Problem::Kind::invalid);
    EXPECT_THAT(large.detail, HasSubstr("images of this service may need 4.9 KiB"));
    EXPECT_THAT(no_picture(previewing(R"({"chain": {"postchain": 1, "passes": ["fxaa"]},
                                          "input": "in.####.exr", "frame": 1})"))
                    .detail,
                HasSubstr("9.8 KiB"));
}

TEST_F(Jobs, ImagesOfWaitingJobs) {
    constexpr const char* kValues = "image/vnd.postchain";
    open_busy();
    submit(body());
    const std::string id = submit(in_folder(body(R"(, "frames": "2")"), "next"));
    // Images as values: magic, width, height, channels, then planes.
    const auto size_of = [](const Picture& picture) {
        std::vector<int> numbers;
        for (size_t at = 4; at < 16; at += 4) numbers.push_back(uint8_t(picture.bytes.at(at)));
        return numbers;
    };
    const Ask ask = [&](auto done) { service_->job_image(user(), id, {kValues, 12}, done); };
    EXPECT_EQ(size_of(picture(ask)), (std::vector{12, 8, 3})) << "its first input";
    fs::remove(root("in.0002.exr"));
    EXPECT_EQ(no_picture(ask).kind, Problem::Kind::not_found);
}

TEST_F(Jobs, ReportsAreReadAndNothingBesideThem) {
    open();
    const std::string id = submit(ab("report"));
    done(id);
    for (const auto& [name, type] : {std::pair{"index.html", "text/html; charset=utf-8"},
                                     {"report.csv", "text/csv; charset=utf-8"},
                                     {"report.json", "application/json"},
                                     {"added.png", "image/png"}}) {
        if (std::string(name).starts_with("added")) write_text(root("report/") + name, "x");
        EXPECT_EQ(got(service_->report_file(user(), id, name)).type, type);
    }
    write_text(root("report/added.exe"), "x");
    write_text(root("secret.json"), "{}");
    write_text(outside("secret.json"), "{}");
    fs::create_symlink(outside("secret.json"), root("report/link.json"));
    for (const char* name :
         {"../secret.json", "/etc/passwd", "", ".", "none.json", ".postchain-report", "images",
          "images/../../secret.json", "link.json", "added.exe"})
        EXPECT_EQ(problem_of(service_->report_file(user(), id, name)).kind,
                  Problem::Kind::not_found)
            << name;
}

// The folders are those of the service when it was submitted, and links lead out of them since.
TEST_F(Jobs, FilesThatLinkOutsideAreNotShown) {
    open();
    const std::string id = submit(body());
    done(id);
    for (const auto& [name, target] : {std::pair{"out/o.0006.exr", "o"}, {"in.0002.exr", "in"}}) {
        fs::rename(root(name), outside(target));
        fs::create_symlink(outside(target), root(name));
    }
    const User& one = user();
    for (const auto& ask : std::vector<Ask>{
             [&](auto done) { service_->frame_image(one, id, 6, true, {}, done); },
             [&](auto done) { service_->frame_image(one, id, 2, false, {}, done); },
             [&](auto done) { service_->job_image(one, id, {}, done); },
             [&](auto done) { service_->input_image(one, "in.####.exr", 2, {}, done); }})
        EXPECT_EQ(no_picture(ask).kind, Problem::Kind::forbidden);
    EXPECT_EQ(problem_of(service_->output(one, id, 6)).kind, Problem::Kind::forbidden);
}

// -------------------------------------------------------------------------------------- users
class Team : public Jobs {
  protected:
    void SetUp() override {
        Jobs::SetUp();
        fs::create_directories(root("bob/out"));
        test::write_sequence(root("bob"), {1, 2}, 24, 16);
        use("  ann: {token: aaaaaaaaaaaaaaaa}\n"
            "  bob: {token: bbbbbbbbbbbbbbbb, roots: [bob]}\n"
            "  ops: {token: oooooooooooooooo, admin: true}\n");
    }
    // A body with its files in the folder bob.
    static std::string of_bob(std::string body) {
        body.replace(body.find("in.####"), 0, "bob/");
        return body.replace(body.find("out/"), 0, "bob/");
    }
};

// Others may look, and not touch. An administrator may.
TEST_F(Team, RightsOfAUser) {
    open();
    const std::string id = submit(body(), "ann");
    done(id);
    const User& bob = user("bob");
    const auto forbids = [](auto answer) {
        return problem_of(std::move(answer)).kind == Problem::Kind::forbidden;
    };
    EXPECT_EQ(job(id).owner, "ann");
    EXPECT_TRUE(forbids(service_->forget(bob, id)));
    EXPECT_TRUE(forbids(service_->cancel(bob, id)));
    EXPECT_TRUE(forbids(service_->retry(bob, id)));
    EXPECT_TRUE(forbids(service_->change(bob, id, R"({"priority": 1})")));
    EXPECT_TRUE(forbids(service_->output(bob, id, 1)));
    EXPECT_EQ(no_picture([&](auto done) {
                  service_->input_image(bob, "out/o.####.exr", 1, {}, done);
              }).kind,
              Problem::Kind::forbidden);
    got(service_->forget(user("ops"), id));
    EXPECT_TRUE(fs::exists(out(1))) << "outputs stay";
    // A user's processes read the user's folders alone.
    fs::remove(root("bob/in.0002.exr"));
    fs::create_symlink(root("in.0002.exr"), root("bob/in.0002.exr"));
    EXPECT_THAT(refused(of_bob(body()), "bob").detail, HasSubstr("bob/in.0002.exr: is outside"));
}

TEST_F(Team, JobsOfARemovedUserDoNotRun) {
    open();
    write_text(root("in.0003.exr"), "no EXR");
    const std::string id = submit(body(), "ann");
    EXPECT_EQ(ended(id).done, 5);
    EXPECT_NE(got(service_->frame(id, 1)).sidecar, "");
    close();
    use("  ops: {token: oooooooooooooooo, admin: true}\n");
    open();
    EXPECT_EQ(got(service_->frame(id, 1)).sidecar, "");
    got(service_->retry(user("ops"), id));
    EXPECT_THAT(ended(id).message, HasSubstr("user 'ann' is no longer in the file of users"));
}

// The outputs of a removed job count until they are deleted.
TEST_F(Team, DiskOfRemovedJobs) {
    use("  ann: {token: aaaaaaaaaaaaaaaa, max_disk: \"1000\"}\n");
    open();
    const std::string first = body(R"(, "frames": "1")");
    const std::string id = submit(first, "ann");
    EXPECT_GT(ended(id).bytes, 1000);
    got(service_->forget(user("ann"), id));
    const std::string again = body(R"(, "frames": "1", "on_existing": "overwrite")");
    EXPECT_THAT(refused(again, "ann").detail, HasSubstr("removed jobs included"));
    EXPECT_THAT(service_->metrics(), HasSubstr("postchain_user_bytes{user=\"ann\"}"));
    for (const auto& file : fs::directory_iterator(root("out"))) fs::remove(file.path());
    submit(again, "ann");
}

}  // namespace
}  // namespace postchain::service
