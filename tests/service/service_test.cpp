// The whole service: jobs over small frames, with and without failures.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

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

class Jobs : public ServiceTest {
  protected:
    std::string out(int frame) const { return root(concat("out/o.000", frame, ".exr")); }
    std::vector<Event> events(const std::string& id) const {
        return std::get<std::vector<Event>>(service_->events(id, 0, 1000));
    }
};

TEST_F(Jobs, AJobIsDone) {
    open();
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
    const auto answer = service_->events(id, 0, 100);
    std::vector<std::string> types;
    for (const Event& event : std::get<std::vector<Event>>(answer)) {
        types.push_back(event.type);
        EXPECT_TRUE(json::parse(event.data).is_object());
    }
    EXPECT_EQ(types, (std::vector<std::string>{"queued", "started", "frames", "frame", "frame",
                                               "frame", "frame", "frame", "frame", "done"}));
    const std::string metrics = service_->metrics();
    EXPECT_NE(metrics.find("postchain_frames_total{result=\"written\"} 6\n"), std::string::npos)
        << metrics;
    EXPECT_NE(metrics.find("postchain_step_seconds_count{step=\"filter\"} 6\n"), std::string::npos);
    EXPECT_NE(metrics.find("postchain_build_info{"), std::string::npos);
    EXPECT_NE(metrics.find("postchain_jobs{state=\"done\"} 1\n"), std::string::npos);
}

TEST_F(Jobs, ListenersHearEveryEventThatIsInTheStore) {
    open();
    std::mutex mutex;
    std::vector<int64_t> heard;
    service_->on_event([&](const Event& event) {
        const std::lock_guard lock(mutex);
        heard.push_back(event.id);
    });
    const std::string id = submit(body());
    ended(id);
    const auto events = std::get<std::vector<Event>>(service_->events("", 0, 100));
    EXPECT_TRUE(wait_for([&] {
        const std::lock_guard lock(mutex);
        return heard.size() == events.size();
    }));
    service_->on_event({});
}

TEST_F(Jobs, AStrangersFileIsNeverReplacedByFail) {
    std::ofstream(out(4)) << "mine";
    open();
    const Job job = ended(submit(body()));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 5);
    EXPECT_NE(job.message.find("out/o.0004.exr: exists"), std::string::npos) << job.message;
    EXPECT_EQ(job.message.find(root()), std::string::npos) << job.message;
    EXPECT_EQ(test::read_text(out(4)), "mine");
    EXPECT_FALSE(fs::exists(out(1)));
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
    EXPECT_NE(frames("2")[0].message.find("exists"), std::string::npos) << frames("2")[0].message;
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
    EXPECT_NE(job.message.find("1 of 6 frames quarantined: 3"), std::string::npos) << job.message;
    const JobFrame frame = frames(id)[2];
    EXPECT_EQ(frame.state, FrameState::quarantined);
    EXPECT_EQ(frame.attempts, attempts_);
    EXPECT_NE(frame.message.find("in.0003.exr"), std::string::npos) << frame.message;
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
class NoShader final : public PlainPass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        return use;
    }
    Guarantees guarantees() const override { return {}; }
    Reach reach() const override { return {}; }
    std::optional<Identity> identity(const PlanContext& context) const override {
        if (context.frame.frame_number == 3) return std::nullopt;
        return Identity{kRuleFacts, {"nothing to do"}};
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
    void reference(const PlanContext&, ReferenceFrame&) const override {}
    ParameterRef parameters() override { return &unused_; }

  private:
    char unused_ = 0;
};

// A GL failure may come from the device, so it is created anew each time.
TEST_F(Jobs, AFailureOfGlIsOneFramesAndTheOthersAreDone) {
    static const ParameterTable no_parameters;
    std::vector<PassType> types = registry_->types();
    types.push_back(
        {.name = "no_shader", .title = "", .help = "", .parameters = &no_parameters, .create = [] {
             return std::make_unique<NoShader>();
         }});
    const PassRegistry registry(types);
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
    EXPECT_NE(frames(id)[2].message.find("nowhere.comp"), std::string::npos);
    size_t anew = 0;
    for (const Event& event : events(id)) anew += event.type == "requeued";
    EXPECT_EQ(anew, size_t(attempts_));
    EXPECT_TRUE(service_->health().gl);
    EXPECT_EQ(ended(submit(body(R"(, "on_existing": "overwrite")"))).state, JobState::done);
    close();
}

TEST_F(Jobs, StopAtTheFirstFrameThatFailsWhereThatIsAskedFor) {
    std::ofstream(root("in.0002.exr"), std::ios::binary) << "no EXR";
    attempts_ = 1;
    open();
    const Job job = ended(submit(body(R"(, "on_error": "stop")")));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.failed, 1);
    EXPECT_EQ(job.exit_code, 4);
    EXPECT_NE(job.message.find("a retry continues"), std::string::npos) << job.message;
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
    EXPECT_NE(missing.detail.find("(missing: skip or hold continues without them)"),
              std::string::npos)
        << missing.detail;
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
    EXPECT_NE(frames(held)[1].message.find("frame 6 is written in its place"), std::string::npos);
}

TEST_F(Jobs, AnOutputFolderThatIsRemovedFailsItsJobAlone) {
    fs::create_directories(root("gone"));
    open();
    std::string in_gone = body();
    in_gone.replace(in_gone.find("out/"), 4, "gone/");
    // When it is submitted, and when it runs.
    fs::remove_all(root("gone"));
    const Problem none = refused(in_gone);
    EXPECT_NE(none.detail.find("gone: folder does not exist; create it or use mkdir: true"),
              std::string::npos)
        << none.detail;
    fs::create_directories(root("gone"));
    for (int frame = 7; frame <= 60; ++frame) test::write_sequence(root(), {frame}, 24, 16);
    const std::string before = submit(body(R"(, "priority": 1)"));
    const std::string waits = submit(in_gone);
    fs::remove_all(root("gone"));
    ended(before);
    const Job job = ended(waits);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 5);
    EXPECT_NE(job.message.find("gone"), std::string::npos) << job.message;
    EXPECT_EQ(ended(submit(body(R"(, "on_existing": "skip")"))).state, JobState::done);
}

TEST_F(Jobs, AFolderThatBecomesALinkIsNotFollowed) {
    fs::create_directories(root("turn"));
    open();
    service_->drain();
    close();
    open();
    std::string turned = body();
    turned.replace(turned.find("out/"), 4, "turn/");
    // A folder when the job is submitted, a link when it runs.
    auto store_settings = settings();
    close();
    {
        auto store = JobStore::open(store_settings.store, 2);
        ASSERT_TRUE(store.ok());
        ASSERT_TRUE((*store)->add({JobKind::run, turned}, 10).ok());
    }
    fs::remove(root("turn"));
    fs::create_directory_symlink(outside(), root("turn"));
    open();
    const Job job = ended("1");
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_TRUE(fs::is_empty(outside()));
}

TEST_F(Jobs, AFrameThatIsALinkToTheOutsideIsNotRead) {
    fs::rename(root("in.0004.exr"), outside("in.0004.exr"));
    fs::create_symlink(outside("in.0004.exr"), root("in.0004.exr"));
    open();
    const Job job = ended(submit(body()));
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_NE(job.message.find("links outside"), std::string::npos) << job.message;
    EXPECT_FALSE(fs::exists(out(4)));
}

TEST_F(Jobs, TheLargerPriorityGoesFirst) {
    for (int frame = 7; frame <= 60; ++frame) test::write_sequence(root(), {frame}, 24, 16);
    fs::create_directories(root("first"));
    open();
    const std::string slow = submit(body(R"(, "priority": -1)"));
    ASSERT_TRUE(wait_for([&] { return job(slow).done >= 2; }));
    std::string urgent = body(R"(, "frames": "1-3", "priority": 5)");
    urgent.replace(urgent.find("out/"), 4, "first/");
    const std::string id = submit(urgent);
    const Job first = ended(id);
    EXPECT_EQ(first.state, JobState::done) << first.message;
    const Job other = ended(slow);
    EXPECT_EQ(other.state, JobState::done) << other.message;
    EXPECT_EQ(other.done, 60);
    EXPECT_LE(first.ended_ms, other.ended_ms);
    size_t ends = 0;
    for (const Event& event : events(slow)) ends += event.type == "frame";
    EXPECT_EQ(ends, 60u);
    for (const JobFrame& frame : frames(slow)) EXPECT_LE(frame.attempts, 1) << frame.frame;
}

TEST_F(Jobs, AStudyMakesWayAndGoesOn) {
    json scenes = json::array();
    for (int i = 0; i < 8; ++i)
        scenes.push_back({{"name", concat("s", i)},
                          {"input", "in.####.exr"},
                          {"truth", i == 3 ? "none.####.exr" : "in.####.exr"}});
    const json study = {{"postchain_study", 1},
                        {"chains", {{"quick", "fast"}, {"report", "paper"}}},
                        {"settings", {{"camera", "camera.json"}, {"repeats", 1}}},
                        {"scenes", scenes}};
    std::ofstream(root("camera.json"))
        << R"({"focal_length_mm": 50, "sensor_width_mm": 36, "f_stop": 2, "focus_distance": 2})";
    open();
    const std::string slow = submit(
        json({{"kind", "study"}, {"study", study}, {"output", "study"}, {"priority", -1}}).dump());
    ASSERT_TRUE(wait_for([&] { return fs::exists(root("study/tasks/s0.quick_vs_report.json")); }));
    const Job first = ended(submit(body()));
    EXPECT_EQ(first.state, JobState::done) << first.message;
    const Job other = ended(slow);
    EXPECT_LE(first.ended_ms, other.ended_ms);
    bool requeued = false;
    for (const Event& event : events(slow)) requeued |= event.type == "requeued";
    EXPECT_TRUE(requeued);
    EXPECT_EQ(other.state, JobState::done) << other.message;
    EXPECT_EQ(other.exit_code, 1);
    EXPECT_NE(other.message.find("scene s3: "), std::string::npos) << other.message;
    EXPECT_EQ(other.message.find(root()), std::string::npos) << other.message;
    const json report = json::parse(test::read_text(root("study/report.json")));
    EXPECT_EQ(report["scenes"].size(), 8u);
    EXPECT_EQ(test::read_text(root("study/report.json")).find(root()), std::string::npos);
    const auto inner = service_->report_file(user(), slow, "scenes/s0/quick_vs_report/index.html");
    EXPECT_TRUE(std::holds_alternative<ResultFile>(inner));
}

TEST_F(Jobs, DrainedWorkGoesOnInTheNextProcess) {
    for (int frame = 7; frame <= 40; ++frame) test::write_sequence(root(), {frame}, 24, 16);
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(wait_for([&] { return job(id).done >= 2; }));
    service_->drain();
    const Job drained = job(id);
    EXPECT_TRUE(drained.state == JobState::queued || drained.state == JobState::done);
    bool created = false;
    const auto late = service_->submit(user(), body(), "", &created);
    ASSERT_TRUE(std::holds_alternative<Problem>(late));
    EXPECT_EQ(std::get<Problem>(late).kind, Problem::Kind::unavailable);
    EXPECT_TRUE(service_->health().draining);
    close();
    open();
    EXPECT_EQ(ended(id).state, JobState::done);
    EXPECT_EQ(ended(id).done, 40);
    for (const JobFrame& frame : frames(id)) EXPECT_EQ(frame.attempts, 1) << frame.frame;
}

TEST_F(Jobs, CanceledAndTriedAgain) {
    for (int frame = 7; frame <= 40; ++frame) test::write_sequence(root(), {frame}, 24, 16);
    open();
    const std::string id = submit(body());
    ASSERT_TRUE(wait_for([&] { return job(id).done >= 1; }));
    const auto canceled = service_->cancel(user(), id);
    ASSERT_TRUE(std::holds_alternative<Job>(canceled));
    EXPECT_EQ(std::get<Job>(canceled).state, JobState::canceled);
    const auto twice = service_->cancel(user(), id);
    EXPECT_EQ(std::get<Problem>(twice).kind, Problem::Kind::conflict);
    ASSERT_TRUE(std::holds_alternative<Job>(service_->retry(user(), id)));
    EXPECT_EQ(ended(id).state, JobState::done);
    EXPECT_EQ(ended(id).done, 40);
    EXPECT_EQ(std::get<Problem>(service_->retry(user(), id)).kind, Problem::Kind::conflict);
    EXPECT_EQ(std::get<Problem>(service_->cancel(user(), "77")).kind, Problem::Kind::not_found);
}

TEST_F(Jobs, KeysAndAFullQueue) {
    max_queue_ = 1;
    open();
    service_->drain();
    close();
    open();
    bool created = false;
    const auto first = service_->submit(user(), body(), "key", &created);
    ASSERT_TRUE(created);
    const std::string id = std::get<Job>(first).id;
    ended(id);
    const auto same = service_->submit(user(), body(), "key", &created);
    EXPECT_FALSE(created);
    EXPECT_EQ(std::get<Job>(same).id, id);
    const auto other = service_->submit(user(), body(" "), "key", &created);
    EXPECT_EQ(std::get<Problem>(other).kind, Problem::Kind::conflict);
    service_->drain();
    close();
    {
        auto store = JobStore::open(settings().store, 2);
        ASSERT_TRUE(store.ok());
        EXPECT_EQ((*store)->add({JobKind::run, body()}, 1)->what, Added::What::made);
        EXPECT_EQ((*store)->add({JobKind::run, body()}, 1)->what, Added::What::full);
    }
    open();
    ended("2");
    // Even if its files have been removed since.
    for (int frame = 1; frame <= 6; ++frame) fs::remove(root(concat("in.000", frame, ".exr")));
    EXPECT_EQ(std::get<Job>(service_->submit(user(), body(), "key", &created)).id, id);
}

TEST_F(Jobs, PreviewsAndThumbnailsWhileAJobIsUnderWay) {
    open();
    const std::string id = submit(body());
    const std::string asked =
        R"({"chain": "fast", "input": "in.####.exr", "frame": 2, "scale": 0.5,
            "set": ["camera.focal_length_mm=50", "camera.sensor_width_mm=36",
                    "camera.f_stop=2", "camera.focus_distance=3"]})";
    const Picture preview =
        picture([&](auto done) { service_->preview(user(), asked, {}, std::move(done)); });
    EXPECT_EQ(preview.type, "image/png");
    ASSERT_GT(preview.bytes.size(), 30u);
    EXPECT_EQ(preview.bytes.substr(1, 3), "PNG");
    EXPECT_EQ(int(uint8_t(preview.bytes[19])), 12) << "half of 24 pixels";
    EXPECT_EQ(int(uint8_t(preview.bytes[23])), 8);
    const Picture exr = picture(
        [&](auto done) { service_->preview(user(), asked, {"image/x-exr"}, std::move(done)); });
    EXPECT_EQ(exr.type, "image/x-exr");
    std::ofstream(root("preview.exr"), std::ios::binary) << exr.bytes;
    const ImageF color = test::read_color(root("preview.exr"));
    EXPECT_EQ(color.width, 12);
    EXPECT_EQ(color.height, 8);
    ended(id);
    for (const bool after : {false, true}) {
        const Picture small = picture(
            [&](auto done) { service_->frame_image(user(), id, 1, after, {}, std::move(done)); });
        EXPECT_EQ(small.bytes.substr(1, 3), "PNG");
    }
    std::promise<Answer<Picture>> none;
    service_->frame_image(user(), id, 99, true, {},
                          [&](Answer<Picture> got) { none.set_value(std::move(got)); });
    EXPECT_EQ(std::get<Problem>(none.get_future().get()).kind, Problem::Kind::not_found);
}

// Values for a page: magic, width, height, channels, then planes.
TEST_F(Jobs, PicturesAsValues) {
    open();
    const auto size = [](const Picture& picture) {
        EXPECT_EQ(picture.type, "image/vnd.postchain");
        EXPECT_EQ(picture.bytes.substr(0, 4), "PPIC");
        std::vector<int> numbers;
        for (size_t at = 4; at < 16; at += 4) numbers.push_back(uint8_t(picture.bytes[at]));
        return numbers;
    };
    const ImageWanted values{"image/vnd.postchain", 12};
    EXPECT_EQ(size(picture([&](auto done) {
                  service_->input_image(user(), "in.####.exr", 2, values, std::move(done));
              })),
              (std::vector{12, 8, 3}));
    const std::string depth =
        R"({"chain": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frame": 2, "plane": "depth"})";
    EXPECT_EQ(size(picture([&](auto done) {
                  service_->preview(user(), depth, {"image/vnd.postchain"}, std::move(done));
              })),
              (std::vector{24, 16, 1}));
    // Distances in a format for other programs: one channel, Z.
    const Picture exr = picture(
        [&](auto done) { service_->preview(user(), depth, {"image/x-exr"}, std::move(done)); });
    EXPECT_EQ(exr.bytes.substr(0, 4), "v/1\1");
    EXPECT_NE(exr.bytes.find(std::string("Z\0\2\0\0\0", 6)), std::string::npos);
    const std::string id = submit(body());
    ended(id);
    EXPECT_EQ(
        size(picture([&](auto done) { service_->job_image(user(), id, values, std::move(done)); })),
        (std::vector{12, 8, 3}));
    std::promise<Answer<Picture>> none;
    service_->input_image(user(), "in.####.exr", 99, values,
                          [&](Answer<Picture> got) { none.set_value(std::move(got)); });
    EXPECT_EQ(std::get<Problem>(none.get_future().get()).kind, Problem::Kind::not_found);
}

TEST_F(Jobs, PlansAndChains) {
    open();
    const auto planned = service_->plan(
        user(),
        R"({"chain": {"postchain": 1, "passes": ["fxaa"]}, "input": "in.####.exr", "frames": "2-3"})");
    ASSERT_TRUE(std::holds_alternative<std::string>(planned));
    const json plan = json::parse(std::get<std::string>(planned));
    ASSERT_EQ(plan["frames"].size(), 2u);
    EXPECT_EQ(plan["frames"][0]["frame"], 2);
    EXPECT_TRUE(plan["frames"][0]["plan"].contains("steps"));
    const auto checked = [&](const char* text) {
        return service_->check_chain(json{{"text", text}}.dump());
    };
    EXPECT_TRUE(std::get<Diagnostics>(checked("postchain: 1\npasses: [fxaa]\n")).empty());
    const auto faults = std::get<Diagnostics>(checked("postchain: 1\npasses: [fxa]\n"));
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].line, 2);
    for (const char* body : {"{\"text\": 5}", "{\"txt\": \"\"}", "[]", "text: a"}) {
        const auto refused = service_->check_chain(body);
        ASSERT_TRUE(std::holds_alternative<Problem>(refused)) << body;
        EXPECT_EQ(std::get<Problem>(refused).diagnostics.size(), 1u) << body;
    }
    EXPECT_TRUE(json::parse(service_->passes()).is_object());
    EXPECT_TRUE(json::parse(service_->chain_schema()).is_object());
    EXPECT_TRUE(service_->job_schema().is_object());
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

TEST_F(Jobs, ReportsAreReadAndNothingBesideThem) {
    open();
    const std::string id = submit(
        R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1-2",
            "output": "report", "repeats": 1, "page_frames": 1})");
    const Job job = ended(id);
    ASSERT_EQ(job.state, JobState::done) << job.message;
    EXPECT_FALSE(job.verdict.empty());
    const auto page = service_->report_file(user(), id, "index.html");
    ASSERT_TRUE(std::holds_alternative<ResultFile>(page));
    EXPECT_EQ(std::get<ResultFile>(page).path, fs::canonical(root("report/index.html")).string());
    std::ofstream(root("secret.json")) << "{}";
    for (const char* name : {"../secret.json", "/etc/passwd", "", ".", "none.json",
                             ".postchain-report", "images", "images/../../secret.json"}) {
        const auto answer = service_->report_file(user(), id, name);
        ASSERT_TRUE(std::holds_alternative<Problem>(answer)) << name;
        EXPECT_EQ(std::get<Problem>(answer).kind, Problem::Kind::not_found) << name;
    }
}

TEST_F(Jobs, ABenchIsDoneAndTakenUpAgain) {
    open();
    const std::string body =
        R"({"kind": "bench", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "input": "in.####.exr", "frames": "1-2", "output": "bench", "repeats": 1,
            "split_frames": 0, "sweep": ["fxaa.preset=12,39"]})";
    const Job job = ended(submit(body));
    ASSERT_EQ(job.state, JobState::done) << job.message;
    EXPECT_NE(job.verdict.find("2 variants"), std::string::npos) << job.verdict;
    EXPECT_EQ(ended(submit(body)).state, JobState::done);
}

TEST_F(Jobs, TwoServicesOnOneStore) {
    open();
    std::unique_ptr<Service> first = std::move(service_);
    const auto second = Service::open(
        settings(), *[] {
            static const PassRegistry none({});
            return &none;
        }());
    ASSERT_FALSE(second.ok());
    EXPECT_NE(second.status().message().find("another service"), std::string::npos);
}

}  // namespace
}  // namespace postchain::service
