// The whole service: jobs over small frames, with and without failures.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tools/service/store/job_store.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::HeldPass;
using test::ServiceTest;
using testing::HasSubstr;
using testing::Not;

class Jobs : public ServiceTest {
  protected:
    std::string out(int frame) const { return root(concat("out/o.000", frame, ".exr")); }
};

TEST_F(Jobs, AJobIsDone) {
    open();
    std::mutex mutex;
    std::vector<int64_t> heard;
    service_->on_event([&](const Event& event) {
        const std::lock_guard lock(mutex);
        heard.push_back(event.id);
    });
    const std::string id = submit(body());
    const Job job = ended(id);
    EXPECT_EQ(job.state, JobState::done) << job.message;
    EXPECT_EQ(job.exit_code, 0);
    EXPECT_EQ(job.frames, 6);
    EXPECT_EQ(job.done, 6);
    for (const JobFrame& frame : frames(id)) {
        EXPECT_EQ(frame.state, FrameState::written);
        EXPECT_EQ(frame.output, concat("out/o.000", frame.frame, ".exr"));
        const auto whole = std::get<JobFrame>(service_->frame(id, frame.frame));
        EXPECT_EQ(whole.output, frame.output);
        EXPECT_EQ(whole.sidecar, test::read_text(out(frame.frame) + ".json"));
        EXPECT_EQ(json::parse(whole.sidecar)["outcome"], "written");
    }
    std::vector<int64_t> stored;
    for (const Event& event : events(id)) {
        EXPECT_TRUE(json::parse(event.data).is_object());
        stored.push_back(event.id);
    }
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(mutex);
        return heard == stored;
    }));
    service_->on_event({});
    EXPECT_EQ(types_of(id), "queued started frames frame frame frame frame frame frame done ");
    const std::string metrics = service_->metrics();
    EXPECT_THAT(metrics, HasSubstr("postchain_frames_total{result=\"written\"} 6\n"));
    EXPECT_THAT(metrics, HasSubstr("postchain_step_seconds_count{step=\"filter\"} 6\n"));
    EXPECT_THAT(metrics, HasSubstr("postchain_build_info{"));
    EXPECT_THAT(metrics, HasSubstr("postchain_jobs{state=\"done\"} 1\n"));
}

TEST_F(Jobs, AStrangersFileIsNeverReplacedByFail) {
    std::ofstream(out(4)) << "mine";
    open();
    const Job job = ended(submit(body()));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 1);
    EXPECT_EQ(job.done, 5);
    EXPECT_THAT(job.message, HasSubstr("1 of 6 frames quarantined: 4"));
    EXPECT_THAT(frames(job.id)[3].message, HasSubstr("out/o.0004.exr: exists"));
    EXPECT_THAT(frames(job.id)[3].message, Not(HasSubstr(root())));
    EXPECT_EQ(test::read_text(out(4)), "mine");
}

// A process died during the job: the outputs are checked frame by frame.
TEST_F(Jobs, AStrangersFileThatCameAfterTheStartStaysToo) {
    open();
    const std::string id = submit(body());
    ASSERT_EQ(ended(id).done, 6);
    const std::string good = test::read_text(out(2));
    close();
    {
        // The state after a kill: 1 and 2 were in flight, 2 was written, 1 was not. Since then
        // another program has written an output 1.
        auto store = JobStore::open(settings().store, 2);
        ASSERT_TRUE(store.ok());
        const auto again = (*store)->add({JobKind::run, body()}, 10);
        ASSERT_GT(*(*store)->start(again->job.id), 0);
        std::vector<JobFrame> frames(2);
        for (int i : {0, 1}) {
            frames[size_t(i)].frame = i + 1;
            frames[size_t(i)].output = out(i + 1);
        }
        ASSERT_TRUE((*store)->enter_frames(again->job.id, frames).ok());
        for (int frame : {1, 2}) ASSERT_TRUE((*store)->frame_begins(again->job.id, frame).ok());
        std::ofstream(out(1)) << "a stranger's";
    }
    const auto time = fs::last_write_time(out(2));
    open();
    const Job job = ended("2");
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(frames("2")[0].state, FrameState::quarantined);
    EXPECT_THAT(frames("2")[0].message, HasSubstr("exists"));
    EXPECT_EQ(test::read_text(out(1)), "a stranger's");
    EXPECT_EQ(frames("2")[1].state, FrameState::written);
    EXPECT_FALSE(std::get<JobFrame>(service_->frame("2", 2)).sidecar.empty());
    EXPECT_EQ(test::read_text(out(2)), good);
    EXPECT_EQ(fs::last_write_time(out(2)), time) << "was written again";
}

TEST_F(Jobs, APoisonedFrameIsQuarantinedAndTheOthersAreDone) {
    std::ofstream(root("in.0003.exr"), std::ios::binary) << "no EXR";
    open();
    const std::string id = submit(body());
    const Job job = ended(id);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 1);
    EXPECT_EQ(job.done, 5);
    EXPECT_EQ(job.failed, 1);
    EXPECT_THAT(job.message, HasSubstr("1 of 6 frames quarantined: 3"));
    const JobFrame frame = frames(id)[2];
    EXPECT_EQ(frame.state, FrameState::quarantined);
    EXPECT_EQ(frame.attempts, attempts_);
    EXPECT_THAT(frame.message, HasSubstr("in.0003.exr"));
    // After the repair a retry does only this frame.
    const auto time = fs::last_write_time(out(1));
    test::write_sequence(root(), {3}, 24, 16);
    ASSERT_TRUE(std::holds_alternative<Job>(service_->retry(user(), id)));
    EXPECT_EQ(ended(id).state, JobState::done);
    EXPECT_EQ(job.created_ms, ended(id).created_ms);
    EXPECT_EQ(frames(id)[2].state, FrameState::written);
    EXPECT_EQ(fs::last_write_time(out(1)), time);
}

// Frame 3 needs a missing shader; the others do not.
class NoShader final : public test::FakePass {
  public:
    std::optional<Identity> identity(const PlanContext& context) const override {
        if (context.frame.frame_number == 3) return std::nullopt;
        return FakePass::identity(context);
    }
    void plan(PassPlanner& planner) const override {
        const TextureId result = planner.texture("color", Format::rgba32f);
        Step step;
        step.name = "nothing";
        step.program = {"nowhere.comp", {}};
        step.bindings = {{0, planner.input(Role::color), Access::sample_nearest},
                         {0, result, Access::write}};
        planner.step(std::move(step));
        planner.output(Role::color, result);
    }
};

// A GL failure may come from the device, so it is created anew each time.
TEST_F(Jobs, AFailureOfGlIsOneFramesAndTheOthersAreDone) {
    const PassRegistry registry = test::with_pass<NoShader>("no_shader");
    registry_ = &registry;
    open();
    std::string broken = body();
    broken.replace(broken.find("fxaa"), 4, "no_shader");
    const std::string id = submit(broken);
    const Job job = ended(id);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.done, 5) << job.message;
    EXPECT_EQ(frames(id)[2].state, FrameState::quarantined);
    EXPECT_EQ(frames(id)[2].attempts, attempts_);
    EXPECT_THAT(frames(id)[2].message, HasSubstr("nowhere.comp"));
    EXPECT_EQ(test::count_of(types_of(id), "requeued"), attempts_);
    EXPECT_TRUE(service_->health().gl);
    EXPECT_EQ(ended(submit(body(R"(, "on_existing": "overwrite")"))).state, JobState::done);
    close();
}

TEST_F(Jobs, OnErrorStopEndsAtTheFirstFailure) {
    std::ofstream(root("in.0002.exr"), std::ios::binary) << "no EXR";
    attempts_ = 1;
    open();
    const Job job = ended(submit(body(R"(, "on_error": "stop")")));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.failed, 1);
    EXPECT_GE(job.done, 1);
    EXPECT_EQ(job.exit_code, 1);  // as of the command: some frames are written
    EXPECT_THAT(job.message, HasSubstr("a retry continues"));
}

// Under `on_existing: fail` the frames that exist are refused, and the others made.
TEST_F(Jobs, OutputsThatExistAreRefusedOneByOne) {
    open();
    ASSERT_EQ(ended(submit(body())).state, JobState::done);
    EXPECT_EQ(ended(submit(body())).exit_code, 5);  // none is made
    const Job stopped = ended(submit(body(R"(, "on_error": "stop")")));
    EXPECT_EQ(stopped.exit_code, 5);
    EXPECT_THAT(frames(stopped.id), ::testing::IsEmpty());
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
    const Job run = ended(submit(body(R"(, "dump_stages": "stages", "png": true)")));
    EXPECT_EQ(run.state, JobState::done) << run.message;
    EXPECT_EQ(run.bytes, size(root()) - inputs);
    const Job ab = ended(submit(
        R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1-2",
            "output": "report", "repeats": 1, "page_frames": 1})"));
    EXPECT_EQ(ab.state, JobState::done) << ab.message;
    EXPECT_EQ(ab.frames, 2);
    EXPECT_EQ(ab.done, 2);
    EXPECT_EQ(ab.bytes, size(root("report")));
}

TEST_F(Jobs, APartOfASequenceInAFolderThatIsMade) {
    open();
    const std::string id =
        submit(R"({"chain": "fast", "set": ["joint_blur.f_stop=4", "joint_blur.focus_distance=3",)"
               R"( "joint_blur.focal_length_mm=35", "joint_blur.sensor_width_mm=36"],)"
               R"( "input": "in.####.exr", "output": "new/deep/o.####.exr", "chunk": "2/3",)"
               R"( "mkdir": true})");
    const Job done = ended(id);
    EXPECT_EQ(done.state, JobState::done) << done.message;
    EXPECT_EQ(done.frames, 2);
    for (const int frame : {1, 2, 3, 4, 5, 6})
        EXPECT_EQ(std::filesystem::exists(root(concat("new/deep/o.000", frame, ".exr"))),
                  frame == 3 || frame == 4)
            << frame;
}

TEST_F(Jobs, FramesThatAreNotThere) {
    open();
    const Problem missing = refused(body(R"(, "frames": "5-8")"));
    EXPECT_EQ(missing.kind, Problem::Kind::invalid);
    EXPECT_THAT(missing.detail, HasSubstr("(missing: skip or hold continues without them)"));
    ASSERT_EQ(missing.diagnostics.size(), 1u);
    EXPECT_EQ(missing.diagnostics[0].path, "frames");
    const std::string id = submit(body(R"(, "frames": "5-8", "missing": "skip")"));
    const Job skip = ended(id);
    EXPECT_EQ(skip.state, JobState::done);
    EXPECT_EQ(skip.exit_code, 1);
    EXPECT_EQ(skip.done, 2);
    EXPECT_EQ(frames(id)[3].state, FrameState::missing);
    const std::string held =
        submit(body(R"(, "frames": "6-7", "missing": "hold", "on_existing": "overwrite")"));
    EXPECT_EQ(ended(held).done, 2) << ended(held).message;
    EXPECT_THAT(frames(held)[1].message, HasSubstr("frame 6 is written in its place"));
}

// When it is submitted, and when it runs.
TEST_F(Jobs, AnOutputFolderThatIsRemovedFailsItsJobAlone) {
    hold();
    const std::string in_gone = in_folder(body(), "gone");
    fs::remove_all(root("gone"));
    EXPECT_THAT(refused(in_gone).detail,
                HasSubstr("gone: folder does not exist; create it or use mkdir: true"));
    fs::create_directories(root("gone"));
    const std::string before = submit(held_body());
    const std::string waits = submit(in_gone);
    fs::remove_all(root("gone"));
    HeldPass::held = false;
    const Job job = ended(waits);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 5);
    EXPECT_THAT(job.message, HasSubstr("gone"));
    EXPECT_EQ(ended(before).state, JobState::done);
    EXPECT_EQ(ended(submit(body(R"(, "on_existing": "skip")"))).state, JobState::done);
}

TEST_F(Jobs, AFolderThatBecomesALinkIsNotFollowed) {
    // A folder when the job is submitted, a link when it runs.
    {
        auto store = JobStore::open(settings().store, 2);
        ASSERT_TRUE(store.ok());
        ASSERT_TRUE((*store)->add({JobKind::run, in_folder(body(), "turn")}, 10).ok());
    }
    fs::remove(root("turn"));
    fs::create_directory_symlink(outside(), root("turn"));
    open();
    const Job job = ended("1");
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_TRUE(fs::is_empty(outside()));
}

// At the beginning of a job, and after it.
TEST_F(Jobs, AFrameThatIsALinkToTheOutsideIsNotRead) {
    const auto replace = [&](const std::string& name) {
        fs::rename(root(name), outside(name));
        fs::create_symlink(outside(name), root(name));
    };
    hold();
    const std::string id = submit(held_body());
    ASSERT_TRUE(wait_for([] { return HeldPass::waits.load(); }));
    replace("in.0006.exr");
    HeldPass::held = false;
    EXPECT_EQ(ended(id).state, JobState::failed);
    EXPECT_THAT(frames(id)[5].message, HasSubstr("links outside"));
    EXPECT_FALSE(fs::exists(out(6)));
    const Job job = ended(submit(in_folder(body(), "next")));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_THAT(job.message, HasSubstr("links outside"));
    EXPECT_FALSE(fs::exists(root("next/o.0001.exr")));
}

TEST_F(Jobs, TheLargerPriorityGoesFirst) {
    add_frames(20);
    hold();
    const std::string slow = submit(held_body(R"(, "priority": -1)"));
    ASSERT_TRUE(wait_for([] { return HeldPass::waits.load(); }));
    const std::string larger =
        submit(in_folder(body(R"(, "frames": "1-3", "priority": 5)"), "first"));
    HeldPass::held = false;
    const Job first = ended(larger);
    EXPECT_EQ(first.state, JobState::done) << first.message;
    const Job other = ended(slow);
    EXPECT_EQ(other.state, JobState::done) << other.message;
    EXPECT_EQ(other.done, 20);
    EXPECT_LE(first.ended_ms, other.ended_ms);
    const std::string types = types_of(slow);
    EXPECT_THAT(types, HasSubstr("requeued"));
    EXPECT_EQ(test::count_of(types, "frame "), 20);
    for (const JobFrame& frame : frames(slow)) EXPECT_LE(frame.attempts, 1) << frame.frame;
}

TEST_F(Jobs, AStudyMakesWayAndGoesOn) {
    json scenes = json::array();
    for (int i = 0; i < 4; ++i)
        scenes.push_back({{"name", concat("s", i)},
                          {"input", "in.####.exr"},
                          {"frames", i == 0 ? "1" : "3"},
                          {"truth", i == 2 ? "none.####.exr" : "in.####.exr"}});
    const json study = {{"postchain_study", 1},
                        {"chains", {{"held", {"held"}}, {"plain", {"fxaa"}}}},
                        {"settings", {{"repeats", 1}}},
                        {"scenes", scenes}};
    hold();
    const std::string slow = submit(
        json({{"kind", "study"}, {"study", study}, {"output", "study"}, {"priority", -1}}).dump());
    ASSERT_TRUE(wait_for([&] { return HeldPass::waits.load(); }));
    const std::string urgent = submit(body());
    HeldPass::held = false;
    const Job first = ended(urgent);
    EXPECT_EQ(first.state, JobState::done) << first.message;
    const Job other = ended(slow);
    EXPECT_LE(first.ended_ms, other.ended_ms);
    EXPECT_THAT(types_of(slow), HasSubstr("requeued"));
    EXPECT_EQ(other.state, JobState::done) << other.message;
    EXPECT_EQ(other.exit_code, 1);
    EXPECT_THAT(other.message, HasSubstr("scene s2: "));
    EXPECT_THAT(other.message, Not(HasSubstr(root())));
    const std::string report = test::read_text(root("study/report.json"));
    EXPECT_EQ(json::parse(report)["scenes"].size(), 4u);
    EXPECT_THAT(report, Not(HasSubstr(root())));
    const auto inner = service_->report_file(user(), slow, "scenes/s0/held_vs_plain/index.html");
    EXPECT_TRUE(std::holds_alternative<ResultFile>(inner));
}

// Each user's Idempotency-Keys are their own.
TEST_F(Jobs, AKeyIsOfItsUser) {
    use("  ann: {token: a234567890123456}\n  ben: {token: b543210987654321}\n");
    hold();
    const auto submitted = [&](const char* name, const std::string& text) {
        bool created = false;
        const auto answer = service_->submit(user(name), text, "key", &created);
        return std::holds_alternative<Job>(answer) ? std::get<Job>(answer).id : std::string();
    };
    const std::string of_ann = submitted("ann", held_body());
    const std::string of_ben = submitted("ben", held_body());
    EXPECT_NE(of_ann, of_ben);
    EXPECT_NE(of_ben, "");
    EXPECT_EQ(submitted("ann", held_body()), of_ann);
    EXPECT_EQ(submitted("ben", held_body()), of_ben);
    EXPECT_EQ(submitted("ben", held_body(" ")), "") << "another body";
    HeldPass::held = false;
}

TEST_F(Jobs, DrainedWorkGoesOnInTheNextProcess) {
    hold();
    const std::string id = submit(held_body());
    ASSERT_TRUE(wait_for([&] { return HeldPass::waits && job(id).done == 2; }));
    const auto drained = std::async(std::launch::async, [&] { service_->drain(); });
    ASSERT_TRUE(wait_for([&] { return service_->health().draining; }));
    HeldPass::held = false;
    drained.wait();
    EXPECT_EQ(refused(body()).kind, Problem::Kind::unavailable);
    close();
    open();
    EXPECT_EQ(ended(id).state, JobState::done);
    EXPECT_EQ(ended(id).done, 6);
    for (const JobFrame& frame : frames(id)) EXPECT_EQ(frame.attempts, 1) << frame.frame;
}

TEST_F(Jobs, CanceledAndTriedAgain) {
    add_frames(12);
    hold();
    const std::string id = submit(held_body());
    ASSERT_TRUE(wait_for([&] { return HeldPass::waits && job(id).done == 2; }));
    const auto canceled = service_->cancel(user(), id);
    ASSERT_TRUE(std::holds_alternative<Job>(canceled));
    EXPECT_EQ(std::get<Job>(canceled).state, JobState::canceled);
    EXPECT_EQ(std::get<Job>(canceled).exit_code, 143) << "as of the command after SIGTERM";
    EXPECT_EQ(std::get<Problem>(service_->cancel(user(), id)).kind, Problem::Kind::conflict);
    HeldPass::held = false;
    // The work under way ends: the next job need not wait for the other frames.
    EXPECT_EQ(ended(submit(in_folder(body(), "next"))).state, JobState::done);
    EXPECT_FALSE(fs::exists(root("out/o.0012.exr")));
    EXPECT_EQ(job(id).done, 2);
    ASSERT_TRUE(std::holds_alternative<Job>(service_->retry(user(), id)));
    EXPECT_EQ(ended(id).state, JobState::done) << ended(id).message;
    EXPECT_EQ(ended(id).done, 12);
    EXPECT_EQ(std::get<Problem>(service_->retry(user(), id)).kind, Problem::Kind::conflict);
    EXPECT_EQ(std::get<Problem>(service_->cancel(user(), "77")).kind, Problem::Kind::not_found);
}

TEST_F(Jobs, KeysAndAFullQueue) {
    max_queue_ = 1;
    hold();
    submit(held_body());
    ASSERT_TRUE(wait_for([] { return HeldPass::waits.load(); }));
    const std::string next = in_folder(body(), "next");
    const auto with_key = [&](const std::string& text, bool is_new) {
        bool created = !is_new;
        auto answer = service_->submit(user(), text, "key", &created);
        EXPECT_EQ(created, is_new);
        return answer;
    };
    const auto first = with_key(next, true);
    ASSERT_TRUE(std::holds_alternative<Job>(first));
    EXPECT_EQ(std::get<Job>(first).place, 1);
    const Problem full = refused(body());
    EXPECT_EQ(full.kind, Problem::Kind::busy);
    EXPECT_GT(full.retry_after_s, 0);
    // Also with a full queue, and if its files have been removed since.
    for (int frame = 1; frame <= 6; ++frame)
        fs::rename(root(concat("in.000", frame, ".exr")), outside(concat(frame)));
    const auto same = with_key(next, false);
    ASSERT_TRUE(std::holds_alternative<Job>(same));
    EXPECT_EQ(std::get<Job>(same).id, std::get<Job>(first).id);
    EXPECT_EQ(std::get<Job>(same).place, 1);
    for (int frame = 1; frame <= 6; ++frame)
        fs::rename(outside(concat(frame)), root(concat("in.000", frame, ".exr")));
    EXPECT_EQ(std::get<Problem>(with_key(next + " ", false)).kind, Problem::Kind::conflict);
    HeldPass::held = false;
    EXPECT_EQ(ended(std::get<Job>(first).id).state, JobState::done);
}

TEST_F(Jobs, HealthSaysWhatIsWrong) {
    open();
    const Health health = service_->health();
    EXPECT_TRUE(health.gl && health.disk && health.queue && health.progress) << health.why;
    EXPECT_FALSE(health.draining);
    EXPECT_FALSE(health.renderer.empty());
    EXPECT_EQ(health.why, "");
    fs::remove_all(root());
    EXPECT_FALSE(service_->health().disk);
    EXPECT_NE(service_->health().why, "");
}

}  // namespace
}  // namespace postchain::service
