// A session without a window: what is shown is what `run` writes, drafts, files that
// change, bad input.
#include "tools/apps/view/session.h"

#include <ctime>
#include <limits>
#include <map>

#include "tests/view/session_fixture.h"
#include "tools/apps/view/session_values.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;
using test::write_text;
using testing::HasSubstr;

// The chain of the session's file with this value.
std::string joint_with_samples(const std::string& value) {
    std::string text = kJoint;
    return text.replace(text.find("samples: 8"), 10, "samples: " + value);
}

TEST_F(SessionTest, ADraftComesBeforeWhatRunWrites) {
    open();
    ASSERT_TRUE(wait_for([&] { return session_->shown().color != nullptr; }));
    EXPECT_TRUE(session_->shown().draft);
    EXPECT_EQ(session_->shown().color->width, 32);
    expect_run_of(1);
    EXPECT_EQ(session_->latencies().refined.size(), 1u);
    EXPECT_TRUE(document().switch_off(0, true).ok());
    expect_run_of(1, "without a pass");
}

TEST_F(SessionTest, AHeldSliderShowsDrafts) {
    fs::create_directory(path("large"));
    test::write_sequence(path("large"), {1}, 320, 240);
    settings_.run.input = frames_of("large/in.####.exr");
    open();
    // Much more work than a draft may take, on any machine.
    for (int64_t samples = 4; session_->shown().milliseconds < 300; samples *= 2) {
        ASSERT_TRUE(document().set(0, "samples", std::min<int64_t>(samples, 1023)).ok());
        settle();
        if (samples > 1023) break;
    }
    const std::chrono::duration<double, std::milli> whole(session_->shown().milliseconds);
    document().begin_gesture();
    EXPECT_TRUE(document().set_camera("f_stop", 1.0).ok());
    ASSERT_TRUE(
        wait_for([&] { return session_->shown().draft && session_->shown().color->width < 320; }));
    // Time enough for a whole picture.
    const auto end = Clock::now() + std::chrono::milliseconds(500) +
                     std::chrono::duration_cast<Clock::duration>(4 * whole);
    while (!wait_for([&] { return Clock::now() > end; })) {
    }
    EXPECT_TRUE(session_->shown().draft) << "the hand does not rest";
    document().end_gesture();
    expect_run_of(1);
}

TEST_F(SessionTest, PlaysEachFrameInTurn) {
    write_frames({4, 7});
    settings_.result_memory = 0;  // each frame is filtered
    open();
    settle();
    EXPECT_EQ(session_->playback().missing_frames(), (std::vector<int>{5, 6}));
    const auto played = [&](int direction, size_t count) {
        std::vector<int> frames{session_->playback().frame()};
        session_->playback().play(direction);
        EXPECT_TRUE(wait_for([&] {
            if (session_->playback().frame() != frames.back()) {
                EXPECT_EQ(session_->shown().frame, frames.back()) << "stays until it is shown";
                frames.push_back(session_->playback().frame());
            }
            return frames.size() == count;
        }));
        session_->playback().play(0);
        return frames;
    };
    EXPECT_EQ(played(1, 6), (std::vector<int>{1, 2, 3, 4, 7, 1}));
    EXPECT_EQ(session_->playback().frames_played(), 5);
    session_->tick(Clock::now() + std::chrono::seconds(10));
    EXPECT_EQ(session_->playback().frame(), 1) << "stands";
    session_->playback().set_range({{4, 2}});
    session_->playback().go_to(7);
    settle();
    EXPECT_EQ(played(-1, 6), (std::vector<int>{7, 4, 3, 2, 4, 3}));
    EXPECT_EQ(played(1, 4), (std::vector<int>{3, 4, 2, 3}));
}

TEST_F(SessionTest, FilteredFramesAreKept) {
    open();
    settle();
    session_->playback().fill_results(true);
    ASSERT_TRUE(wait_for([&] { return !session_->playback().filling(); }));
    settle();
    EXPECT_EQ(session_->playback().frame(), 1) << "back where it began";
    EXPECT_EQ(session_->frames_with_result(), (std::set<int>{1, 2, 3}));
    const SharedFrame first = session_->source();
    // Each is shown at once, and is what run writes.
    for (const int frame : {2, 3, 1}) {
        session_->playback().go_to(frame);
        ASSERT_TRUE(wait_for([&] { return session_->source() != nullptr; }));
        session_->tick();
        EXPECT_EQ(session_->shown().frame, frame);
        EXPECT_FALSE(session_->shown().draft);
        expect_run_of(frame);
    }
    EXPECT_EQ(session_->source(), first) << "it is not read again";
    const auto kept = session_->shown().color;
    EXPECT_TRUE(document().set(0, "samples", int64_t(12)).ok());
    EXPECT_TRUE(session_->frames_with_result().empty()) << "of another chain";
    expect_run_of(1, "after an edit");
    document().undo();
    session_->tick();
    EXPECT_EQ(session_->shown().color, kept) << "undo finds it again";
    // A frame that is rendered again.
    const SharedFrame former = session_->source();
    write_frames({1}, {.convention = "nuke"});
    ASSERT_TRUE(wait_for([&] { return session_->source() && session_->source() != former; }));
    expect_run_of(1, "rendered again");
    EXPECT_NE(session_->shown().color, kept);
}

TEST_F(SessionTest, FilteredFramesKeepWithinMemory) {
    settings_.result_memory = 2 * 64 * 48 * 4 * sizeof(float);
    open();
    settle();
    for (const int frame : {2, 3, 1, 2}) {
        session_->playback().go_to(frame);
        settle();
        EXPECT_LE(session_->results().bytes(), session_->results().budget());
    }
    EXPECT_FALSE(session_->frames_with_result().empty());
}

TEST_F(SessionTest, ASessionAtRestDoesNothing) {
    open();
    settle();
    const auto processor_ms = [] {
        timespec time;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
        return double(time.tv_sec) * 1e3 + double(time.tv_nsec) * 1e-6;
    };
    // The waiting threads alone: the window's loop is in the test of the window.
    constexpr std::chrono::milliseconds kWatched{3000};
    const double before = processor_ms();
    std::this_thread::sleep_for(kWatched);
    EXPECT_LT(100 * (processor_ms() - before) / double(kWatched.count()), 2) << "% of a core";
}

TEST_F(SessionTest, FocusFollowsAClick) {
    open();
    settle();
    // make_planes(): a square at distance 2 before a ground at distance 6.
    EXPECT_TRUE(focus_at_pixel(*session_, 0, 0).ok());
    EXPECT_EQ(document().chain().camera.focus_distance, 6.0) << "with few digits";
    expect_run_of(1);
    const auto limits = sharp_limits(*session_);
    ASSERT_TRUE(limits);
    EXPECT_LT((*limits)[0], 6);
    EXPECT_GT((*limits)[1], 6);
    document().undo();
    EXPECT_EQ(document().chain().camera.focus_distance, 2);
    EXPECT_EQ(focus_at_pixel(*session_, -1, 0).code(), StatusCode::input);
}

TEST_F(SessionTest, ValuesUnderTheCursor) {
    test::Planes planes = test::make_planes(64, 48, 1);
    planes.depth.at(5, 7) = std::numeric_limits<float>::infinity();
    for (int c = 0; c < 4; ++c) planes.color.at(9, 7, c) = float(c + 1) / 8;
    planes.motion.at(9, 7, 0) = 2.5f;
    planes.motion.at(9, 7, 1) = -1.25f;
    test::write_frame(path("in.0001.exr"), planes);
    open();
    settle();
    const auto values = [&](int x, int y) {
        std::map<std::string, std::string> found;
        for (const auto& [name, text] : values_at(*session_, x, y)) found[name] = text;
        return found;
    };
    const auto here = values(9, 7);
    for (const char* name : {"result", "color", "depth", "motion", "motion_back"})
        EXPECT_TRUE(here.contains(name)) << name;
    EXPECT_EQ(here.at("color"), "0.125  0.25  0.375  0.5");
    EXPECT_EQ(here.at("motion"), "2.5  -1.25");
    EXPECT_EQ(here.at("depth"), "6");
    EXPECT_EQ(values(5, 7).at("depth"), "sky");
    for (const auto& [x, y] : {std::pair(-1, 7), {9, -1}, {64, 7}, {9, 48}})
        EXPECT_TRUE(values(x, y).empty()) << x << " " << y;
    EXPECT_EQ(focus_at_pixel(*session_, 5, 7).code(), StatusCode::input);
    EXPECT_EQ(focus_pull(*session_, {5, 7}, {9, 7}).code(), StatusCode::input);
    EXPECT_EQ(focus_pull(*session_, {9, 7}, {5, 7}).code(), StatusCode::input);
    EXPECT_FALSE(document().can_undo());
    // With keys, a click sets one for this frame.
    EXPECT_TRUE(document().set_focus_key(3, 4).ok());
    EXPECT_TRUE(focus_at_pixel(*session_, 9, 7).ok());
    EXPECT_EQ(document().state().focus_keys, (std::map<int, double>{{1, 6}, {3, 4}}));
}

TEST_F(SessionTest, AValueIsSetFromWhatItInherits) {
    open();
    settle();
    const auto row_of = [&](const char* key) -> const Parameter& {
        return *document().chain().links[0].type->parameters->find(key);
    };
    const auto of = [&](const char* key) { return inherited(*session_, 0, row_of(key)); };
    ASSERT_TRUE(of("f_stop"));
    EXPECT_EQ(of("f_stop")->value, ParameterValue(1.4));
    EXPECT_EQ(of("f_stop")->from, "the camera");
    EXPECT_EQ(of("shutter_angle_deg")->value, ParameterValue(180.0));
    EXPECT_TRUE(of("max_radius_px")) << "as the filter has resolved it";
    EXPECT_FALSE(of("focus_at"));
    EXPECT_EQ(first_value(row_of("f_stop"), of("f_stop")), ParameterValue(1.4));
    EXPECT_TRUE(document().passes_with_own("f_stop").empty());
    EXPECT_TRUE(document().set(0, "f_stop", 4.0).ok());
    EXPECT_TRUE(document().set(0, "shutter_angle_deg", 90.0).ok());
    EXPECT_EQ(document().passes_with_own("f_stop"), std::vector<std::string>{"joint_blur"});
    EXPECT_EQ(document().passes_with_own("shutter_frames").size(), 1u);
    EXPECT_TRUE(document().set_camera("shutter_frames", 0.25).ok());
    EXPECT_TRUE(document().passes_with_own("shutter_frames").empty());
}

TEST_F(SessionTest, AFocusPullIsOneStepAndGoesIntoTheCameraFile) {
    open();
    settle();
    int square = 0;
    while (square < 64 && distance_at(*session_, square, 24) != 2.0) ++square;
    ASSERT_LT(square, 64);
    ASSERT_TRUE(focus_pull(*session_, {square, 24}, {0, 0}).ok());
    EXPECT_EQ(document().chain_at(1).camera.focus_distance, 2);
    EXPECT_NEAR(*document().chain_at(2).camera.focus_distance, 3, 1e-5);
    EXPECT_TRUE(save_camera(*session_, path("camera.json"), false).ok());
    const auto file = load_camera(path("camera.json"));
    ASSERT_TRUE(file.ok());
    EXPECT_NEAR(*file->camera_for(2, {}).focus_distance, 3, 1e-5);
    EXPECT_EQ(save_camera(*session_, path("camera.json"), false).code(), StatusCode::output);
    document().undo();
    EXPECT_FALSE(document().can_undo());
}

TEST_F(SessionTest, TheMotionPathFollowsTheVectors) {
    open();
    settle();
    const auto path_of_ground = motion_path(*session_, 0, 0);
    ASSERT_GT(path_of_ground.size(), 2u);
    // The ground came by (-3, 1.5) pixels and goes on by (-2, 1); the shutter is open for half.
    EXPECT_NEAR(path_of_ground.front()[0], 0.5 + 0.75, 1e-5);
    EXPECT_NEAR(path_of_ground.front()[1], 0.5 - 0.375, 1e-5);
    EXPECT_NEAR(path_of_ground.back()[0], 0.5 - 0.5, 1e-5);
    EXPECT_NEAR(path_of_ground.back()[1], 0.5 + 0.25, 1e-5);
}

TEST_F(SessionTest, AnyPlaneIsShown) {
    open();
    settle();
    const auto show = [&](const std::string& plane) {
        session_->view().plane = plane;
        settle();
        EXPECT_TRUE(session_->painted().image) << plane;
    };
    const auto plan = session_->shown().plan;
    for (const std::string& plane : planes_of(*session_)) show(plane);
    int shown = 0;
    for (const PlanTexture& texture : plan->textures) {
        if (texture.imported || texture.format == Format::work_list) continue;
        show(texture.name);
        ASSERT_TRUE(session_->shown().texture) << texture.name;
        EXPECT_EQ(session_->shown().texture->width, texture.width);
        ++shown;
    }
    EXPECT_GT(shown, 3);
    show(kFillMask);
    ASSERT_TRUE(session_->shown().texture);
    const ImageF& mask = *session_->shown().texture;
    for (size_t i = 0; i < mask.pixels(); ++i)
        ASSERT_NEAR(mask.data[4 * i] + mask.data[4 * i + 1] + mask.data[4 * i + 2], 1, 1e-4);
    PaintJob job;
    job.image = session_->shown().texture;
    job.look = Look::shares;
    EXPECT_EQ(session_->painted().image->data, paint(job).image->data);
}

// A draft is of its own frame and scale.
TEST_F(SessionTest, TheWorkerFiltersWhatIsAskedFor) {
    const std::string fxaa = "postchain: 1\npasses: [fxaa]\n";
    settings_.open.chain = parse_chain(fxaa, "", builtin_passes()).chain.clone();
    open();
    SharedFrame sources[2];
    for (const int frame : {1, 2}) {
        session_->playback().go_to(frame);
        settle();
        sources[frame - 1] = session_->source();
    }
    const auto worker = FilterWorker::start(session_->settings().context, {}, [] {});
    ASSERT_TRUE(worker.ok());
    const auto chain = std::make_shared<const Chain>(document().chain_at(1));
    uint64_t id = 0;
    const auto filtered = [&](int source, double scale, const std::string& texture = "") {
        FilterRequest request;
        request.id = ++id;
        request.source = sources[source];
        request.chain = chain;
        request.scale = scale;
        request.texture = texture;
        (*worker)->submit(std::move(request));
        std::vector<FilterResult> results;
        EXPECT_TRUE(wait_for([&] {
            results = (*worker)->take();
            return !results.empty();
        }));
        EXPECT_EQ(results.size(), 1u);
        EXPECT_TRUE(results[0].status.ok()) << results[0].status.message();
        EXPECT_EQ(results[0].request.id, id);
        EXPECT_EQ(results[0].texture != nullptr, !texture.empty());
        EXPECT_EQ(results[0].color->width, int(64 * scale));
        EXPECT_EQ(results[0].color->height, int(48 * scale));
        return std::move(results[0]);
    };
    const ImageF first = *filtered(0, 0.5).color, second = *filtered(1, 0.5).color;
    filtered(1, 0.25);
    EXPECT_NE(first.data, second.data);
    EXPECT_EQ(filtered(0, 0.5).color->data, first.data);
    EXPECT_EQ(filtered(1, 1).color->data, session_->shown().color->data);
    const auto luma = filtered(1, 0.25, "0.fxaa.luma").texture;
    ASSERT_TRUE(luma);
    EXPECT_EQ(luma->width, 16);
    EXPECT_EQ(luma->channels, 1);
    EXPECT_TRUE((*worker)->idle());
}

TEST_F(SessionTest, ComparesWithTheFrameChainBAndGroundTruth) {
    fs::create_directory(path("truth"));
    for (const int frame : {1, 2})
        fs::copy_file(path(concat("in.000", frame + 1, ".exr")),
                      path(concat("truth/in.000", frame, ".exr")));
    settings_.truth = settings_.run;
    settings_.truth->input = frames_of("truth/in.####.exr");
    open();
    settle();
    const ImageF as_held = *session_->shown().color;
    session_->view().compare = Compare::difference;
    session_->keep_as_other_chain();
    EXPECT_TRUE(document().set(0, "samples", int64_t(2)).ok());
    const std::pair<CompareTarget, ImageF> cases[] = {
        {CompareTarget::before, test::read_color(path("in.0001.exr"))},
        {CompareTarget::other_chain, as_held},
        {CompareTarget::truth, test::read_color(path("in.0002.exr"))}};
    const auto compares_with = [&](CompareTarget target, const ImageF& other) {
        session_->view().target = target;
        const Rgba expected = *painted(other, Look::color, session_->view().display);
        ASSERT_TRUE(wait_for([&] { return session_->painted().other && session_->at_rest(); }));
        EXPECT_EQ(session_->painted().other->data, expected.data) << int(target);
        EXPECT_FALSE(session_->painted().metrics.empty());
        EXPECT_TRUE(session_->painted().map) << int(target);
    };
    for (const auto& [target, other] : cases) compares_with(target, other);
    // On another frame, and with another chain B on the same one.
    const auto kept = [&](int64_t samples) {
        EXPECT_TRUE(document().set(0, "samples", samples).ok());
        const ImageF color = as_run(session_->playback().frame());
        session_->keep_as_other_chain();
        EXPECT_TRUE(document().set(0, "samples", int64_t(2)).ok());
        return color;
    };
    session_->playback().go_to(2);
    compares_with(CompareTarget::before, test::read_color(path("in.0002.exr")));
    compares_with(CompareTarget::truth, test::read_color(path("in.0003.exr")));
    EXPECT_TRUE(document().set(0, "samples", int64_t(8)).ok());
    const ImageF as_at_first = as_run(2);
    EXPECT_TRUE(document().set(0, "samples", int64_t(2)).ok());
    compares_with(CompareTarget::other_chain, as_at_first);
    compares_with(CompareTarget::other_chain, kept(4));
    compares_with(CompareTarget::other_chain, kept(6));
    ASSERT_FALSE(HasFailure());
    // One that fails says so, and the next one is compared again.
    EXPECT_TRUE(document().set_camera("focal_length_mm", ParameterValue()).ok());
    session_->keep_as_other_chain();
    EXPECT_TRUE(document().set_camera("focal_length_mm", 50.0).ok());
    ASSERT_TRUE(wait_for([&] { return says("chain B: "); }));
    compares_with(CompareTarget::other_chain, kept(4));
}

TEST_F(SessionTest, AGroundTruthOfAnotherSizeIsNotCompared) {
    fs::create_directory(path("truth"));
    test::write_sequence(path("truth"), {1}, 32, 24);
    settings_.truth = settings_.run;
    settings_.truth->input = frames_of("truth/in.####.exr");
    open();
    session_->view().compare = Compare::wipe;
    session_->view().target = CompareTarget::truth;
    ASSERT_TRUE(wait_for([&] { return says("32x24 pixels, the frame has 64x48"); }));
    settle();
    EXPECT_FALSE(session_->painted().other);
    EXPECT_TRUE(session_->painted().image);
}

TEST_F(SessionTest, ASequenceThatGrowsAndLosesFrames) {
    open();
    settle();
    write_frames({4});
    ASSERT_TRUE(wait_for([&] { return session_->playback().frames().size() == 4; }));
    session_->playback().step(-1);
    expect_run_of(4);
    session_->playback().go_to(3);
    expect_run_of(3, "with the frame after it");
    fs::remove(path("in.0002.exr"));
    ASSERT_TRUE(wait_for([&] { return session_->playback().frames().size() == 3; }));
    expect_run_of(3, "without the frame before it");
    const SharedFrame former = session_->source();
    write_frames({4}, {.convention = "nuke"});
    ASSERT_TRUE(wait_for([&] { return session_->source() && session_->source() != former; }));
    expect_run_of(3, "with a neighbor that is rendered anew");
    // The frame that is shown is removed.
    fs::remove(path("in.0003.exr"));
    expect_trouble("in.0003.exr: frame is not on disk");
    session_->playback().go_to(4);
    settle();
    EXPECT_EQ(session_->trouble(), "");
}

TEST_F(SessionTest, AnUnreadableFrameDoesNotEndTheSession) {
    write_text(path("in.0002.exr"), "no image");
    open();
    settle();
    EXPECT_EQ(session_->picture_state(), "refined");
    session_->playback().go_to(2);
    expect_trouble("in.0002.exr");
    settle();
    EXPECT_EQ(session_->picture_state(), "of frame 1");
    session_->playback().go_to(3);
    settle();
    EXPECT_EQ(session_->trouble(), "");
    EXPECT_TRUE(session_->shown().color);
}

TEST_F(SessionTest, AnEmptyFolderIsOpenedWhenItsFirstFrameIsThere) {
    settings_.run.input = frames_of("later.####.exr");
    open();
    settle();
    EXPECT_TRUE(says("later.####.exr"));
    fs::copy_file(path("in.0002.exr"), path("later.0007.exr"));
    ASSERT_TRUE(wait_for([&] { return session_->shown().color != nullptr; }));
    EXPECT_EQ(session_->playback().frame(), 7);
}

TEST_F(SessionTest, AFrameLargerThanMemorySaysSo) {
    settings_.run.source.max_memory = 1000;
    open();
    expect_trouble("memory");
}

TEST_F(SessionTest, AChainThatCannotRunKeepsThePicture) {
    open();
    settle();
    const auto before = session_->painted().image;
    // A lens that this frame does not know.
    EXPECT_TRUE(document().set_camera("focal_length_mm", ParameterValue()).ok());
    expect_trouble("focal_length_mm");
    settle();
    EXPECT_TRUE(session_->painted().image) << "the frame as it is";
    EXPECT_EQ(session_->picture_state(), "as before");
    document().undo();
    session_->tick();
    EXPECT_EQ(session_->trouble(), "") << "the failure is of the former request";
    settle();
    EXPECT_EQ(session_->painted().image->data, before->data);
}

TEST_F(SessionTest, TheChainFileIsReloaded) {
    open();
    settle();
    write_text(path("chain.yaml"), joint_with_samples("x"));
    ASSERT_TRUE(wait_for([&] { return says("chain.yaml:5:"); })) << "the line of the fault";
    EXPECT_FALSE(document().can_undo()) << "the chain stays";
    write_text(path("chain.yaml"), joint_with_samples("16"));
    ASSERT_TRUE(wait_for([&] { return document().can_undo(); }));
    EXPECT_FALSE(document().changed());
    expect_run_of(1);
    EXPECT_TRUE(document().set(0, "samples", int64_t(4)).ok());
    ASSERT_TRUE(session_->open_chain().save(path("chain.yaml"), false).ok());
    EXPECT_EQ(test::read_text(path("chain.yaml")), joint_with_samples("4"));
    EXPECT_EQ(session_->open_chain().save(path("in.0001.exr"), true).code(), StatusCode::usage)
        << "an input is never replaced";
    EXPECT_EQ(session_->open_chain().save(path("chain.json"), true).code(), StatusCode::output);
}

TEST_F(SessionTest, AReloadedChainKeepsTheValuesOfSet) {
    settings_.open.sets = {"fxaa.mode=directional"};
    open();
    write_text(path("chain.yaml"), joint_with_samples("16"));
    ASSERT_TRUE(wait_for([&] { return document().can_undo(); }));
    EXPECT_THAT(document().chain().text(), HasSubstr("mode=directional"));
}

TEST_F(SessionTest, AChangeOfTheFileByOthersIsNotOverwritten) {
    open();
    settle();
    const std::string text = std::string(kJoint) + "# by others\n";
    write_text(path("chain.yaml"), text);
    EXPECT_TRUE(document().set(0, "samples", int64_t(4)).ok());
    EXPECT_EQ(session_->open_chain().save(path("chain.yaml"), false).code(), StatusCode::output);
    EXPECT_EQ(test::read_text(path("chain.yaml")), text);
    EXPECT_TRUE(session_->open_chain().save(path("chain.yaml"), true).ok());
}

TEST_F(SessionTest, EditsOfAViewerThatWasKilledComeBack) {
    const std::string edits = path("state/view");
    const auto open_again = [&] {
        settings_ = given_settings();
        settings_.open.recovery_folder = edits;
        open();
    };
    open_again();
    EXPECT_TRUE(document().erase(0).ok());
    EXPECT_TRUE(document().set_focus_key(1, 2.5).ok());
    EXPECT_TRUE(document().add("motion_blur", 0).ok());
    EXPECT_TRUE(document().switch_off(0, true).ok());
    const std::string edited = document().chain().text();
    ASSERT_TRUE(wait_for([&] {
        return fs::exists(edits) &&
               std::any_of(fs::directory_iterator(edits), fs::directory_iterator(),
                           [](const auto& file) { return file.path().extension() == ".json"; });
    }));
    // A viewer beside it has edits of its own.
    auto killed = std::move(session_);
    open_again();
    EXPECT_FALSE(document().changed());
    session_.reset();
    // The first one ends without a word; its folder stays.
    killed.reset();
    open_again();
    EXPECT_TRUE(says("restored"));
    EXPECT_EQ(document().chain().text(), edited);
    EXPECT_TRUE(document().state().off[0]);
    EXPECT_EQ(document().state().focus_keys.at(1), 2.5);
    EXPECT_TRUE(document().changed());
    document().undo();
    EXPECT_FALSE(document().changed()) << "one step leads back to the file";
    document().redo();
    EXPECT_TRUE(session_->open_chain().save(path("chain.yaml"), false).ok());
    EXPECT_TRUE(save_camera(*session_, path("keys.json"), false).ok());
    session_.reset();
    open_again();
    EXPECT_FALSE(says("restored")) << "all is saved";
}

TEST_F(SessionTest, ADamagedRecoveryFileIsTold) {
    const auto open_with = [&](const std::string& left) {
        settings_ = given_settings();
        settings_.open.recovery_folder = path("state");
        session_.reset();
        for (const auto& entry : fs::directory_iterator(path("state")))
            if (entry.path().extension() == ".json") write_text(entry.path().string(), left);
        open();
        EXPECT_FALSE(document().can_undo() && says("damaged")) << left;
        return says("the recovery file is damaged; its edits are lost");
    };
    fs::create_directory(path("state"));
    EXPECT_FALSE(open_with(""));
    EXPECT_TRUE(document().set_camera("f_stop", 4.0).ok());
    const auto file = [&]() -> fs::path {
        for (const auto& entry : fs::directory_iterator(path("state")))
            if (entry.path().extension() == ".json") return entry.path();
        return {};
    };
    ASSERT_TRUE(wait_for([&] { return !file().empty(); }));
    const std::string whole = test::read_text(file().string());
    const std::string chain = whole.substr(0, whole.find("\"off\""));
    EXPECT_FALSE(open_with(whole));
    EXPECT_EQ(document().chain().camera.f_stop, 4.0);
    for (const std::string& left :
         {whole.substr(0, whole.size() / 2), std::string("{}"), std::string("[]"),
          chain + R"("off": [false], "focus_keys": {}})", chain + R"("off": 1, "focus_keys": {}})",
          chain + R"("off": [false, false], "focus_keys": {"x": 1}})",
          chain + R"("off": [false, false], "focus_keys": {"1": "near"}})"})
        EXPECT_TRUE(open_with(left)) << left;
}

TEST_F(SessionTest, OnlyTheirOwnFilesAreReplaced) {
    write_text(path("profile.yaml"), "a profile");
    write_text(path("own.json"), "{}");
    settings_.run.other_inputs = {{path("profile.yaml"), "the profile"},
                                  {path("own.json"), "the camera file"}};
    settings_.run.source.camera = *load_camera(path("own.json"));
    open();
    settle();
    EXPECT_EQ(session_->open_chain().save(path("profile.yaml"), true).code(), StatusCode::usage);
    EXPECT_TRUE(document().set_focus_key(1, 2).ok());
    EXPECT_EQ(save_camera(*session_, path("profile.yaml"), true).code(), StatusCode::usage);
    EXPECT_EQ(save_camera(*session_, path("own.json"), false).code(), StatusCode::usage);
    EXPECT_TRUE(document().keys_changed());
    EXPECT_TRUE(save_camera(*session_, path("own.json"), true).ok());
    EXPECT_FALSE(document().keys_changed());
}

TEST_F(SessionTest, ChangesLeakNoTextures) {
    settings_.result_memory = 0;  // each frame is filtered
    open();
    settle();
    // Drafts, of a size that depends on the machine's speed, have textures of their own, which
    // are deleted some frames later: the least counts, and a busy machine needs more frames.
    const auto least_alive = [&](int frames, uint64_t enough) {
        uint64_t least = UINT64_MAX;
        for (int i = 0; i < frames && least > enough; ++i) {
            session_->playback().step(1);
            settle();
            least = std::min(least, session_->shown().counters.textures_alive);
        }
        return least;
    };
    const uint64_t before = least_alive(16, 0);
    for (int i = 12; i >= 0; --i) {
        EXPECT_TRUE(document().set_camera("f_stop", 1.4 + 0.1 * i).ok());
        session_->playback().step(1);
        settle();
    }
    EXPECT_LE(least_alive(200, before), before);
}

TEST_F(SessionTest, ShadersAreCompiledAgain) {
    const std::string shaders = path("shaders");
    fs::copy(std::string(POSTCHAIN_SOURCE_DIR) + "/shaders", shaders, fs::copy_options::recursive);
    setenv("POSTCHAIN_SHADER_DIR", shaders.c_str(), 1);
    settings_.shaders = shaders;
    open();
    unsetenv("POSTCHAIN_SHADER_DIR");
    settle();
    const auto good = session_->shown().color;
    const std::string file = shaders + "/fxaa/fxaa.comp";
    const std::string text = test::read_text(file);
    ASSERT_NE(text, "");
    write_text(file, text + "\nthis is no GLSL\n");
    ASSERT_TRUE(wait_for([&] { return says("fxaa/fxaa.comp"); }));
    const auto line = std::count(text.begin(), text.end(), '\n') + 2;
    EXPECT_TRUE(says(std::to_string(line))) << "line " << line;
    settle();
    EXPECT_EQ(session_->shown().color->data, good->data) << "by the last good program";
    session_->messages().clear();
    write_text(file, text);
    ASSERT_TRUE(wait_for([&] { return says("shaders changed"); }));
    settle();
    EXPECT_EQ(session_->trouble(), "");
}

}  // namespace
}  // namespace postchain::view
