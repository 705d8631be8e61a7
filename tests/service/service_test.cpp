// The whole service: jobs over small frames, with and without failures.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/service/store/job_store.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::got;
using test::HeldPass;
using test::problem_of;
using test::ServiceTest;
using test::write_text;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Jobs : public ServiceTest {
  protected:
    std::string out(int frame) const { return root(concat("out/o.000", frame, ".exr")); }
};

TEST_F(Jobs, AJobIsDone) {
    open();
    const std::string id = submit(body());
    EXPECT_EQ(done(id).exit_code, 0);
    EXPECT_EQ(job(id).frames, 6);
    EXPECT_EQ(job(id).done, 6);
    for (const JobFrame& frame : frames(id)) {
        EXPECT_EQ(frame.state, FrameState::written);
        EXPECT_EQ(frame.output, concat("out/o.000", frame.frame, ".exr"));
        const JobFrame whole = got(service_->frame(id, frame.frame));
        EXPECT_EQ(whole.output, frame.output);
        EXPECT_EQ(whole.sidecar, test::read_text(out(frame.frame) + ".json"));
    }
    for (const Event& event : events(id)) EXPECT_TRUE(json::parse(event.data).is_object());
    EXPECT_EQ(types_of(id), "queued started frames frame frame frame frame frame frame done ");
    const std::string metrics = service_->metrics();
    for (const char* line :
         {"postchain_frames_total{result=\"written\"} 6\n",
          "postchain_step_seconds_count{step=\"filter\"} 6\n", "postchain_jobs{state=\"done\"} 1\n",
          "process_resident_memory_bytes "})
        EXPECT_THAT(metrics, HasSubstr(line));
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
        const auto store = test::must(JobStore::open(settings().store, 2));
        const std::string again = store->add({JobKind::run, body()}, 10)->job.id;
        ASSERT_GT(*store->start(again), 0);
        std::vector<JobFrame> frames(2);
        for (int i : {0, 1}) {
            frames[size_t(i)].frame = i + 1;
            frames[size_t(i)].output = out(i + 1);
        }
        ASSERT_TRUE(store->enter_frames(again, frames).ok());
        for (int frame : {1, 2}) ASSERT_TRUE(store->frame_begins(again, frame).ok());
        std::ofstream(out(1)) << "a stranger's";
    }
    const auto time = fs::last_write_time(out(2));
    open();
    EXPECT_EQ(ended("2").state, JobState::failed);
    EXPECT_EQ(frames("2")[0].state, FrameState::quarantined);
    EXPECT_THAT(frames("2")[0].message, HasSubstr("exists"));
    EXPECT_EQ(test::read_text(out(1)), "a stranger's");
    EXPECT_EQ(frames("2")[1].state, FrameState::written);
    EXPECT_FALSE(got(service_->frame("2", 2)).sidecar.empty());
    EXPECT_EQ(test::read_text(out(2)), good);
    EXPECT_EQ(fs::last_write_time(out(2)), time) << "was written again";
}

// An input that cannot be read, and an output that has come into being since the submission.
TEST_F(Jobs, FramesThatFailAreQuarantinedAndTheOthersAreDone) {
    std::ofstream(root("in.0003.exr"), std::ios::binary) << "no EXR";
    hold();
    const std::string before = submit(in_folder(held_body(R"(, "frames": "5")"), "before"));
    ASSERT_TRUE(waits());
    const std::string id = submit(body());
    std::ofstream(out(4)) << "mine";
    HeldPass::held = false;
    done(before);
    const Job job = ended(id);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 1);
    EXPECT_EQ(job.done, 4);
    EXPECT_EQ(job.failed, 2);
    const JobFrame unread = frames(id)[2], exists = frames(id)[3];
    EXPECT_EQ(job.message, "2 of 6 frames quarantined: 3-4; frame 3: " + unread.message);
    EXPECT_THAT(events(id).back().data, HasSubstr(unread.message));
    EXPECT_EQ(unread.state, FrameState::quarantined);
    EXPECT_EQ(unread.attempts, attempts_);
    EXPECT_THAT(unread.message, HasSubstr("in.0003.exr"));
    EXPECT_THAT(exists.message, HasSubstr("out/o.0004.exr: exists"));
    EXPECT_THAT(exists.message, Not(HasSubstr(root())));
    EXPECT_EQ(test::read_text(out(4)), "mine");
    // After the repair a retry does only these frames.
    const auto time = fs::last_write_time(out(1));
    test::write_sequence(root(), {3}, 24, 16);
    fs::remove(out(4));
    retry(id);
    EXPECT_EQ(job.created_ms, done(id).created_ms);
    EXPECT_EQ(frames(id)[2].state, FrameState::written);
    EXPECT_EQ(fs::last_write_time(out(1)), time);
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
    std::ofstream(out(4)) << "mine";
    fs::create_symlink("nowhere", out(5));
    hold();
    for (const char* more : {"", R"(, "on_error": "stop")", R"(, "on_existing": "fail")"})
        EXPECT_THAT(why(body(more)),
                    HasSubstr("2 of 6 outputs exist already: out/o.0004.exr and others"));
    EXPECT_THAT(why(body(R"(, "frames": "4")")), HasSubstr("1 of 1 output exists already: "));
    // Its sidecar.
    std::ofstream(out(6) + ".json") << "{}";
    EXPECT_THAT(why(body(R"(, "frames": "6")")), HasSubstr("out/o.0006.exr.json"));
    const std::string bare = submit(body(R"(, "frames": "6", "sidecar": false)"));
    done(bare);
    fs::remove(out(6) + ".json");
    EXPECT_EQ(got(service_->frame(bare, 6)).sidecar, "");
    // A job that runs, and one that waits.
    const std::string runs = submit(held_body(R"(, "frames": "3")"));
    ASSERT_TRUE(waits());
    EXPECT_THAT(why(body(R"(, "frames": "2-3")")),
                HasSubstr(concat("job ", runs, " is going to write frame 3 to the same file")));
    const std::string beside = submit(body(R"(, "frames": "2")"));  // another frame
    // One that waits and can write nothing: its chain is gone.
    write_text(root("chain.yaml"), test::kFxaa);
    submit(in_folder(R"({"chain": "chain.yaml", "input": "in.####.exr", "frames": "1",
                         "output": "out/o.####.exr"})",
                     "free"));
    fs::remove(root("chain.yaml"));
    const std::string free = submit(in_folder(body(R"(, "frames": "1")"), "free"));
    const std::string ab = R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
        "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1",
        "repeats": 1, "output": )";
    const std::string report = submit(ab + R"("report"})");
    EXPECT_THAT(why(ab + R"("out/../report"})"), HasSubstr("is going to write this report"));
    const std::string all = submit(body(R"(, "on_existing": "overwrite")"));
    HeldPass::held = false;
    for (const std::string& id : {runs, beside, report, free}) done(id);
    EXPECT_EQ(done(all).done, 6);
    EXPECT_THAT(why(ab + R"("report"})"), HasSubstr("report"));
    done(submit(ab + R"("report", "on_existing": "overwrite"})"));
    // Files that are not frames of the input.
    done(submit(body(R"(, "frames": "5-8", "missing": "skip", "on_existing": "skip")")));
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
    const std::string id = submit(body("", "no_shader"));
    EXPECT_EQ(ended(id).state, JobState::failed);
    EXPECT_EQ(job(id).done, 5) << job(id).message;
    EXPECT_EQ(frames(id)[2].state, FrameState::quarantined);
    EXPECT_EQ(frames(id)[2].attempts, attempts_);
    EXPECT_THAT(frames(id)[2].message, HasSubstr("nowhere.comp"));
    EXPECT_EQ(test::count_of(types_of(id), "requeued"), attempts_);
    EXPECT_TRUE(service_->health().gl);
    done(submit(body(R"(, "on_existing": "overwrite")")));
    close();
}

// A report with the reasons is written in both cases.
TEST_F(Jobs, AnAbFailsIfBothChainsDo) {
    const PassRegistry registry = test::with_pass<NoShader>("no_shader");
    registry_ = &registry;
    open();
    for (const auto& [other, state] :
         {std::pair("fxaa", JobState::done), std::pair("no_shader", JobState::failed)}) {
        const Job job = ran(in_folder(
            concat(R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["no_shader"]},
                "chain_b": {"postchain": 1, "passes": [")",
                   other,
                   R"("]}, "input": "in.####.exr", "frames": "3", "repeats": 1, "page_frames": 1,
                "output": "out/report"})"),
            other));
        EXPECT_EQ(job.state, state) << job.message;
        EXPECT_EQ(job.exit_code, 1);
        EXPECT_THAT(job.message, HasSubstr("nowhere.comp"));
        EXPECT_TRUE(std::filesystem::exists(root(concat(other, "/report/report.json"))));
    }
    close();
}

// The message of the command names options.
TEST_F(Jobs, AFaultNamesTheKeysOfTheRequest) {
    open();
    EXPECT_THAT(refused(body(R"(, "ocio": "in.0001.exr")")).detail,
                HasSubstr("ocio: has no effect by itself; add png: true, output_transfer: or "
                          "input_transfer"));
    for (const std::string more : {"", R"(, "frames": "1-6")"}) {
        std::string one = body(more);
        one.replace(one.find("o.####"), 6, "o");
        EXPECT_THAT(refused(one).detail, HasSubstr("error: output: out/o.exr: the output name is "
                                                   "the same for 6 frames"));
    }
}

TEST_F(Jobs, OutputsThatCannotBeAreRefusedAtSubmission) {
    open();
    const auto to = [&](const std::string& output) {
        std::string one = body(R"(, "on_existing": "overwrite")");
        return refused(one.replace(one.find("out/o.####.exr"), 14, output)).detail;
    };
    EXPECT_THAT(to("in.####.exr"),
                HasSubstr("error: output: in.0001.exr: the output of frame 1 would replace the "
                          "input in.0001.exr, which this job reads; name another output"));
    EXPECT_THAT(to("out/" + std::string(230, 'o') + ".####.exr"),
                HasSubstr("the name of the sidecar of frame 1 has 244 bytes"));
    EXPECT_THAT(
        refused(R"({"kind": "bench", "chain": {"postchain": 1, "passes": ["fxaa"]},
                    "input": "in.####.exr", "output": ".", "sweep": ["fxaa.blend=stored"]})")
            .detail,
        HasSubstr("error: output: .: is the folder of a report, and the input in.0001.exr, which "
                  "this job reads, is in it"));
}

TEST_F(Jobs, OnErrorStopEndsAtTheFirstFailure) {
    std::ofstream(root("in.0002.exr"), std::ios::binary) << "no EXR";
    attempts_ = 1;
    open();
    const Job job = ran(body(R"(, "on_error": "stop")"));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.failed, 1);
    EXPECT_GE(job.done, 1);
    EXPECT_EQ(job.exit_code, 1);  // as of the command: some frames are written
    EXPECT_THAT(job.message, HasSubstr("a retry continues"));
}

TEST_F(Jobs, AFrameThatStrictRefusesHasTheCodeOfTheCommand) {
    test::Planes planes = test::make_planes(24, 16);
    planes.color.at(20, 3, 0) = NAN;
    test::write_frame(root("in.0002.exr"), planes);
    open();
    for (const std::string more : {"", R"(, "on_error": "stop", "on_existing": "overwrite")"}) {
        const Job job = ran(body(R"(, "strict": true)" + more));
        EXPECT_EQ(job.state, JobState::failed);
        EXPECT_EQ(job.exit_code, 7) << more;
        EXPECT_THAT(job.message, HasSubstr("non-finite"));
        EXPECT_FALSE(fs::exists(out(2)));
    }
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
    const std::string measures =
        R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1-2",
            "output": "report", "repeats": 1, "page_frames": 1})";
    const Job ab = done(submit(measures));
    EXPECT_EQ(ab.frames, 2);
    EXPECT_EQ(ab.done, 2);
    EXPECT_EQ(ab.bytes, size(root("report")));
    // It reads the camera of a generated scene, which is beside the frames.
    write_text(root("camera.json"), R"({"aperture_image": "../outside/a.exr"})");
    const std::string again = std::string(measures).replace(measures.find("report"), 6, "again");
    EXPECT_THAT(ran(again).message,
                HasSubstr("camera.json: names an aperture image outside the folders"));
}

// Motion vectors are made from the matrices of the frames before and after, whose names start at
// the root, wherever the service runs.
TEST_F(Jobs, CamerasOfNeighboringFramesAreFound) {
    test::FrameFile file;
    file.convention = "generic";
    file.motion = false;
    fs::create_directory(root("pan"));
    for (const int frame : {1, 2, 3}) {
        file.attributes["worldToCamera"] = concat("1 0 0 0 0 1 0 0 0 0 1 0 ", frame, " 0 0 1");
        test::write_sequence(root("pan"), {frame}, 24, 16, file);
    }
    write_text(root("pan/camera.json"), R"({"focal_length_mm": 40, "sensor_width_mm": 36})");
    open();
    auto made = [&, at = 0](const std::string& input) mutable {
        const std::string output = concat("out/pan", ++at, ".exr");
        done(submit(json{
            {"chain_text", test::kMotionBlur},
            {"input", input},
            {"camera", "pan/camera.json"},
            {"frames", "2"},
            {"output",
             output}}.dump()));
        return test::read_color(root(output));
    };
    const ImageF blurred = made("pan/in.####.exr");
    EXPECT_EQ(blurred.data, made(root("pan/in.####.exr")).data);
    EXPECT_GT(test::largest_difference(blurred, test::read_color(root("pan/in.0002.exr"))), 0.05);
}

TEST_F(Jobs, FramesThatAreNotThere) {
    open();
    const Problem missing = refused(body(R"(, "frames": "5-8")"));
    EXPECT_EQ(missing.kind, Problem::Kind::invalid);
    EXPECT_THAT(missing.detail, HasSubstr("(missing: skip or hold continues without them)"));
    ASSERT_EQ(missing.diagnostics.size(), 1u);
    EXPECT_EQ(missing.diagnostics[0].path, "frames");
    std::string none = body();
    none.replace(none.find("in.####"), 2, "none");
    EXPECT_EQ(refused(none).diagnostics.at(0).path, "input");
    EXPECT_THAT(refused(body(R"(, "frames": "1-100001", "missing": "skip")")).detail,
                HasSubstr("frames: 100001 are more than 100000; submit several jobs"));
    const Job skip = done(submit(body(R"(, "frames": "5-8", "missing": "skip")")));
    EXPECT_EQ(skip.exit_code, 1);
    EXPECT_EQ(skip.done, 2);
    EXPECT_EQ(frames(skip.id)[3].state, FrameState::missing);
    const Job held =
        ran(body(R"(, "frames": "6-7", "missing": "hold", "on_existing": "overwrite")"));
    EXPECT_EQ(held.done, 2) << held.message;
    EXPECT_THAT(frames(held.id)[1].message, HasSubstr("frame 6 is written in its place"));
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
    done(before);
    done(submit(body(R"(, "on_existing": "skip")")));
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

class MakesWay : public Jobs {
  protected:
    // A job of HeldPass ends behind one of a larger priority that comes while it is under way.
    std::string made_way(
        const std::string& slow_body, const std::function<void()>& then = [] {}) {
        const std::string slow = submit(slow_body);
        EXPECT_TRUE(waits());
        then();
        const std::string urgent = submit(in_folder(body(R"(, "frames": "1-3")"), "first"));
        EXPECT_EQ(got(service_->change(user(), urgent, R"({"priority": 9})")).priority, 9);
        HeldPass::held = false;
        EXPECT_LE(done(urgent).ended_ms, done(slow).ended_ms);
        EXPECT_THAT(types_of(slow), HasSubstr("requeued"));
        return slow;
    }
};

TEST_F(MakesWay, ARun) {
    add_frames(20);
    hold();
    const std::string slow = made_way(held_body(R"(, "priority": -1)"));
    EXPECT_EQ(job(slow).done, 20);
    EXPECT_EQ(test::count_of(types_of(slow), "frame "), 20);
    for (const JobFrame& frame : frames(slow)) EXPECT_LE(frame.attempts, 1) << frame.frame;
    for (const char* change : {R"({"priority": 101})", "{}", R"({"priority": "1"})",
                               R"({"priority": 1, "frames": 2})", "[]"})
        EXPECT_EQ(problem_of(service_->change(user(), slow, change)).kind, Problem::Kind::invalid)
            << change;
    EXPECT_EQ(problem_of(service_->change(user(), slow, R"({"priority": 1})")).kind,
              Problem::Kind::conflict);
}

TEST_F(MakesWay, ABench) {
    hold();
    const std::string slow = made_way(
        R"({"kind": "bench", "chain": {"postchain": 1, "passes": ["fxaa", "held"]}, "priority": -1,
            "input": "in.####.exr", "frames": "3", "output": "bench", "repeats": 3,
            "split_frames": 0, "sweep": ["fxaa.preset=12,39"]})");
    EXPECT_THAT(job(slow).verdict, HasSubstr("2 variants"));
}

TEST_F(MakesWay, AStudy) {
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
    fs::create_directories(root("study/tasks"));
    std::ofstream(root("study/.postchain-study")) << "This folder is a study of postchain.\n";
    const std::string result = root("study/tasks/s0.held_vs_plain.json"), first = outside("first");
    std::ofstream(result) << "of an earlier study";
    const std::string slow = made_way(json({{"kind", "study"},
                                            {"study", study},
                                            {"output", "study"},
                                            {"on_existing", "overwrite"},
                                            {"priority", -1}})
                                          .dump(),
                                      [&] { fs::create_hard_link(result, first); });
    EXPECT_EQ(job(slow).exit_code, 1);
    EXPECT_TRUE(fs::equivalent(result, first)) << "it is not measured again";
    EXPECT_THAT(job(slow).message, HasSubstr("scene s2: "));
    const std::string report = test::read_text(root("study/report.json"));
    EXPECT_EQ(json::parse(report)["scenes"].size(), 4u);
    EXPECT_THAT(job(slow).message + report, Not(HasSubstr(root())));
    got(service_->report_file(user(), slow, "scenes/s0/held_vs_plain/index.html"));
}

TEST_F(Jobs, DrainedWorkGoesOnInTheNextProcess) {
    hold();
    const std::string id = submit(held_body());
    ASSERT_TRUE(waits());
    wait_for_done(id, 2);
    const auto drained = std::async(std::launch::async, [&] { service_->drain(); });
    ASSERT_TRUE(wait_for([&] { return service_->health().draining; }));
    HeldPass::held = false;
    drained.wait();
    EXPECT_EQ(refused(body()).kind, Problem::Kind::unavailable);
    close();
    open();
    EXPECT_EQ(done(id).done, 6);
    for (const JobFrame& frame : frames(id)) EXPECT_EQ(frame.attempts, 1) << frame.frame;
}

// Nothing is recorded while the store is away. What was written then is this job's own.
TEST_F(Jobs, AStoreThatIsAwayDuringAJobCostsNoFrame) {
    hold();
    const std::string id = submit(held_body(R"(, "frames": "1-3")"));
    ASSERT_TRUE(waits());
    wait_for_done(id, 2);
    fs::rename(settings().store, folder_.path("away.db"));
    HeldPass::held = false;
    // By the watch, and by the worker that has failed to record a frame.
    EXPECT_TRUE(wait_for([&] {
        return test::count_of(service_->health().why, "the store was removed or replaced") == 2;
    }));
    const std::string made = test::read_text(out(3));
    EXPECT_EQ(refused(in_folder(body(), "next")).kind, Problem::Kind::unavailable);
    fs::rename(folder_.path("away.db"), settings().store);
    EXPECT_EQ(done(id).done, 3);
    EXPECT_EQ(test::read_text(out(3)), made);
    for (const JobFrame& frame : frames(id)) {
        EXPECT_EQ(frame.state, FrameState::written) << frame.frame;
        EXPECT_EQ(frame.attempts, 1) << frame.frame;
    }
}

TEST_F(Jobs, CanceledAndTriedAgain) {
    add_frames(12);
    hold();
    const std::string id = submit(held_body());
    ASSERT_TRUE(waits());
    wait_for_done(id, 2);
    const Job canceled = got(service_->cancel(user(), id));
    EXPECT_EQ(canceled.state, JobState::canceled);
    EXPECT_EQ(canceled.exit_code, 143) << "as of the command after SIGTERM";
    EXPECT_EQ(problem_of(service_->cancel(user(), id)).kind, Problem::Kind::conflict);
    HeldPass::held = false;
    // The work under way ends: the next job need not wait for the other frames.
    done(submit(in_folder(body(), "next")));
    EXPECT_FALSE(fs::exists(root("out/o.0012.exr")));
    EXPECT_EQ(job(id).done, 2);
    retry(id);
    EXPECT_EQ(done(id).done, 12);
    EXPECT_EQ(problem_of(service_->retry(user(), id)).kind, Problem::Kind::conflict);
    EXPECT_EQ(problem_of(service_->cancel(user(), "77")).kind, Problem::Kind::not_found);
    EXPECT_EQ(problem_of(service_->events("77", 0, 9)).kind, Problem::Kind::not_found);
}

TEST_F(Jobs, AJobThatGoesOnWithAnEditedFileMixesNoFrames) {
    for (const std::string edited : {"", "chain.yaml", "camera.json", "outputs"}) {
        const std::string chain = "postchain: 1\npasses: [held]\n", camera = R"({"f_stop": 2})";
        write_text(root("chain.yaml"), chain);
        write_text(root("camera.json"), camera);
        const std::string body = in_folder(R"({"chain": "chain.yaml", "camera": "camera.json",
 "input": "in.####.exr", "output": "out/o.####.exr", "on_existing": "skip"})",
                                           "edited" + edited);
        close();
        hold();
        const std::string id = submit(body);
        ASSERT_TRUE(waits());
        wait_for_done(id, 2);
        got(service_->cancel(user(), id));
        HeldPass::held = false;
        if (edited != "camera.json")
            write_text(root("chain.yaml"),
                       edited.empty() ? chain : "postchain: 1\npasses: [held, fxaa]\n");
        else
            write_text(root("camera.json"), R"({"f_stop": 4})");
        for (int frame = 1; edited == "outputs" && frame <= 2; ++frame)
            fs::remove(root(concat("editedoutputs/o.000", frame, ".exr")));
        retry(id);
        if (edited.empty() || edited == "outputs") {
            EXPECT_EQ(done(id).done, 6) << "written again with the same text, or none to mix with";
            continue;
        }
        const Job failed = ended(id);
        EXPECT_EQ(failed.state, JobState::failed);
        EXPECT_EQ(failed.exit_code, 4);
        EXPECT_EQ(failed.done, 2);
        EXPECT_THAT(failed.message, StartsWith(edited + ": the "));
        EXPECT_THAT(failed.message, HasSubstr(" was changed after frame 1 was made with it; submit "
                                              "the job again, with on_existing: skip"));
        // Made again, all of them.
        const std::string again = submit(body);
        EXPECT_EQ(done(again).done, 6);
        for (const JobFrame& frame : frames(again))
            EXPECT_EQ(frame.state, FrameState::written) << frame.frame;
    }
}

TEST_F(Jobs, KeysAndAFullQueue) {
    max_queue_ = 1;
    use("  ann: {token: a234567890123456}\n  ben: {token: b543210987654321}\n");
    hold();
    submit(held_body(), "ann");
    ASSERT_TRUE(waits());
    const std::string next = in_folder(body(), "next");
    // As long as a key may be.
    const std::string key(255, 'k');
    bool made = false;
    const Problem longer = problem_of(service_->submit(user("ann"), next, key + "k", &made));
    EXPECT_THAT(longer.detail, HasSubstr("Idempotency-Key is longer than 255 bytes"));
    const auto with_key = [&](const std::string& text, bool is_new, const char* name = "ann") {
        bool created = !is_new;
        auto answer = service_->submit(user(name), text, key, &created);
        EXPECT_EQ(created, is_new);
        return answer;
    };
    const Job first = got(with_key(next, true));
    EXPECT_EQ(first.place, 1);
    // Keys are their user's own: this is another job.
    const Problem full = problem_of(with_key(in_folder(body(), "bens"), false, "ben"));
    EXPECT_EQ(full.kind, Problem::Kind::busy);
    EXPECT_GT(full.retry_after_s, 0);
    // Also with a full queue, and if its files have been removed since.
    fs::rename(root("in.0001.exr"), outside("1"));
    const Job same = got(with_key(next, false));
    EXPECT_EQ(same.id, first.id);
    EXPECT_EQ(same.place, 1);
    fs::rename(outside("1"), root("in.0001.exr"));
    EXPECT_EQ(problem_of(with_key(next + " ", false)).kind, Problem::Kind::conflict);
    EXPECT_TRUE(wait_for([&] { return !service_->health().queue; }));
    EXPECT_THAT(service_->health().why, HasSubstr("the queue is full"));
    // A retry waits for room too.
    got(service_->cancel(user("ann"), first.id));
    const std::string other = submit(in_folder(body(), "other"), "ann");
    EXPECT_EQ(problem_of(service_->retry(user("ann"), first.id)).kind, Problem::Kind::busy);
    got(service_->cancel(user("ann"), other));
    got(service_->retry(user("ann"), first.id));
    HeldPass::held = false;
    done(first.id);
}

TEST_F(Jobs, HealthSaysWhatIsWrong) {
    open();
    const Health health = service_->health();
    EXPECT_TRUE(health.gl && health.disk && health.queue && health.progress) << health.why;
    EXPECT_FALSE(health.draining);
    EXPECT_FALSE(health.renderer.empty());
    EXPECT_EQ(health.why, "");
    fs::remove_all(root());
    EXPECT_TRUE(wait_for([&] { return !service_->health().disk; }));
    EXPECT_NE(service_->health().why, "");
}

}  // namespace
}  // namespace postchain::service
