// A session without a window: what is shown is what `run` writes, drafts, files that
// change, bad input.
#include "tools/apps/view/session.h"

#include <ctime>

#include "tests/view/session_fixture.h"
#include "tools/apps/view/session_values.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;
using test::write_text;

TEST_F(SessionTest, ARefinedPictureIsWhatRunWrites) {
    open();
    settle();
    EXPECT_EQ(session_->frame(), 1);
    for (const int frame : {1, 2, 3}) {
        session_->go_to(frame);
        settle();
        ASSERT_FALSE(session_->shown().draft);
        EXPECT_EQ(session_->shown().frame, frame);
        EXPECT_EQ(session_->shown().color->data, as_run(frame).data) << frame;
    }
    EXPECT_TRUE(session_->document().set(0, "samples", int64_t(12)).ok());
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(3).data) << "after an edit";
    EXPECT_TRUE(session_->document().switch_off(0, true).ok());
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(3).data) << "without a pass";
}

TEST_F(SessionTest, ADraftComesFirst) {
    open();
    ASSERT_TRUE(wait_for([&] { return session_->shown().color != nullptr; }));
    EXPECT_TRUE(session_->shown().draft);
    EXPECT_EQ(session_->shown().color->width, 32);
    settle();
    EXPECT_EQ(session_->shown().color->width, 64);
    EXPECT_EQ(session_->latencies().refined.size(), 1u);
}

TEST_F(SessionTest, AHeldSliderShowsDrafts) {
    fs::create_directory(path("large"));
    test::write_sequence(path("large"), {1}, 320, 240);
    settings_.run.input = *io::InputSpec::parse(path("large/in.####.exr"));
    open();
    // Much more work than a draft may take, on any machine.
    for (int64_t samples = 64; session_->shown().milliseconds < 300; samples *= 2) {
        ASSERT_TRUE(session_->document().set(0, "samples", std::min<int64_t>(samples, 1023)).ok());
        settle();
        if (samples > 1023) break;
    }
    const std::chrono::duration<double, std::milli> whole(session_->shown().milliseconds);
    session_->document().begin_gesture();
    EXPECT_TRUE(session_->document().set_camera("f_stop", 1.0).ok());
    ASSERT_TRUE(
        wait_for([&] { return session_->shown().draft && session_->shown().color->width < 320; }));
    // Time enough for a whole picture.
    const auto end = Clock::now() + std::chrono::milliseconds(500) +
                     std::chrono::duration_cast<Clock::duration>(4 * whole);
    while (!wait_for([&] { return Clock::now() > end; })) {
    }
    EXPECT_TRUE(session_->shown().draft) << "the hand does not rest";
    session_->document().end_gesture();
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(1).data);
}

TEST_F(SessionTest, PlaysEachFrameInTurn) {
    settings_.result_memory = 0;  // each frame is filtered
    open();
    settle();
    session_->play(1);
    std::vector<int> frames{session_->frame()};
    ASSERT_TRUE(wait_for([&] {
        if (session_->frame() != frames.back()) {
            EXPECT_EQ(session_->shown().frame, frames.back()) << "a frame stays until it is shown";
            frames.push_back(session_->frame());
        }
        return frames.size() == 7;
    }));
    session_->play(0);
    EXPECT_EQ(frames, (std::vector<int>{1, 2, 3, 1, 2, 3, 1}));
    EXPECT_EQ(session_->frames_played(), 6);
    session_->tick(Clock::now() + std::chrono::seconds(10));
    EXPECT_EQ(session_->frame(), 1) << "stands";
}

TEST_F(SessionTest, PlaysBackwardAndInARange) {
    test::write_sequence(folder_.path(), {4, 7}, 64, 48);
    open();
    EXPECT_EQ(session_->missing_frames(), (std::vector<int>{5, 6}));
    session_->set_range({{4, 2}});
    session_->go_to(7);
    std::vector<int> frames{7};
    const auto play = [&](int direction, size_t count) {
        session_->play(direction);
        ASSERT_TRUE(wait_for([&] {
            if (session_->frame() != frames.back()) frames.push_back(session_->frame());
            return frames.size() == count;
        }));
        session_->play(0);
    };
    play(-1, 6);
    EXPECT_EQ(frames, (std::vector<int>{7, 4, 3, 2, 4, 3}));
    play(1, 9);
    EXPECT_EQ(frames, (std::vector<int>{7, 4, 3, 2, 4, 3, 4, 2, 3}));
}

TEST_F(SessionTest, FilteredFramesAreKept) {
    open();
    settle();
    session_->fill_results(true);
    ASSERT_TRUE(wait_for([&] { return !session_->filling(); }));
    settle();
    EXPECT_EQ(session_->frame(), 1) << "back where it began";
    EXPECT_EQ(session_->frames_with_result(), (std::set<int>{1, 2, 3}));
    // Each is shown at once, and is what run writes.
    for (const int frame : {2, 3, 1}) {
        session_->go_to(frame);
        ASSERT_TRUE(wait_for([&] { return session_->source() != nullptr; }));
        session_->tick();
        EXPECT_EQ(session_->shown().frame, frame);
        EXPECT_FALSE(session_->shown().draft);
        EXPECT_EQ(session_->shown().color->data, as_run(frame).data) << frame;
    }
    const auto kept = session_->shown().color;
    EXPECT_TRUE(session_->document().set(0, "samples", int64_t(12)).ok());
    EXPECT_TRUE(session_->frames_with_result().empty()) << "of another chain";
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(1).data);
    session_->document().undo();
    session_->tick();
    EXPECT_EQ(session_->shown().color, kept) << "undo finds it again";
    // A frame that is rendered again.
    const SharedFrame former = session_->source();
    test::write_sequence(folder_.path(), {1}, 64, 48, {.convention = "nuke"});
    ASSERT_TRUE(wait_for([&] { return session_->source() && session_->source() != former; }));
    settle();
    EXPECT_NE(session_->shown().color, kept);
    EXPECT_EQ(session_->shown().color->data, as_run(1).data);
}

TEST_F(SessionTest, FilteredFramesKeepWithinMemory) {
    settings_.result_memory = 2 * 64 * 48 * 4 * sizeof(float);
    open();
    settle();
    for (const int frame : {2, 3, 1, 2}) {
        session_->go_to(frame);
        settle();
        EXPECT_LE(session_->result_bytes(), *session_->settings().result_memory);
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
    const double percent = 100 * (processor_ms() - before) / double(kWatched.count());
    std::printf("at rest: %.2f %% of a core\n", percent);
    EXPECT_LT(percent, 2);
}

TEST_F(SessionTest, FocusFollowsAClick) {
    open();
    settle();
    // make_planes(): a square at distance 2 before a ground at distance 6.
    ASSERT_TRUE(distance_at(*session_, 0, 0));
    EXPECT_FLOAT_EQ(float(*distance_at(*session_, 0, 0)), 6);
    EXPECT_TRUE(focus_at_pixel(*session_, 0, 0).ok());
    EXPECT_NEAR(*session_->document().chain().camera.focus_distance, 6, 1e-5);
    settle();
    const auto limits = sharp_limits(*session_);
    ASSERT_TRUE(limits);
    EXPECT_LT((*limits)[0], 6);
    EXPECT_GT((*limits)[1], 6);
    EXPECT_EQ(session_->shown().color->data, as_run(1).data);
    session_->document().undo();
    EXPECT_EQ(session_->document().chain().camera.focus_distance, 2);
    EXPECT_EQ(focus_at_pixel(*session_, -1, 0).code(), StatusCode::input);
}

TEST_F(SessionTest, AValueIsSetFromWhatItInherits) {
    open();
    settle();
    const auto of = [&](size_t link, const char* key) {
        const Parameter& row =
            *session_->document().chain().links[link].type->parameters->find(key);
        return inherited(*session_, link, row);
    };
    ASSERT_TRUE(of(0, "f_stop"));
    EXPECT_EQ(of(0, "f_stop")->value, ParameterValue(1.4));
    EXPECT_EQ(of(0, "f_stop")->from, "the camera");
    EXPECT_EQ(of(0, "shutter_angle_deg")->value, ParameterValue(180.0));
    ASSERT_TRUE(of(0, "max_radius_px")) << "as the filter has resolved it";
    EXPECT_FALSE(of(0, "focus_at"));
    const Parameter& f_stop =
        *session_->document().chain().links[0].type->parameters->find("f_stop");
    EXPECT_EQ(first_value(f_stop, of(0, "f_stop")), ParameterValue(1.4));
    EXPECT_TRUE(session_->document().passes_with_own("f_stop").empty());
    EXPECT_TRUE(session_->document().set(0, "f_stop", 4.0).ok());
    EXPECT_TRUE(session_->document().set(0, "shutter_angle_deg", 90.0).ok());
    EXPECT_EQ(session_->document().passes_with_own("f_stop"),
              std::vector<std::string>{"joint_blur"});
    EXPECT_EQ(session_->document().passes_with_own("shutter_frames").size(), 1u);
    EXPECT_TRUE(session_->document().set_camera("shutter_frames", 0.25).ok());
    EXPECT_TRUE(session_->document().passes_with_own("shutter_frames").empty());
}

TEST_F(SessionTest, AFocusPullIsOneStepAndGoesIntoTheCameraFile) {
    open();
    settle();
    int square = 0;
    while (square < 64 && distance_at(*session_, square, 24) != 2.0) ++square;
    ASSERT_LT(square, 64);
    ASSERT_TRUE(focus_pull(*session_, {square, 24}, {0, 0}).ok());
    EXPECT_EQ(session_->document().chain_at(1).camera.focus_distance, 2);
    EXPECT_NEAR(*session_->document().chain_at(2).camera.focus_distance, 3, 1e-5);
    EXPECT_TRUE(save_camera(*session_, path("camera.json"), false).ok());
    const auto file = load_camera(path("camera.json"));
    ASSERT_TRUE(file.ok());
    EXPECT_NEAR(*file->camera_for(2, {}).focus_distance, 3, 1e-5);
    EXPECT_EQ(save_camera(*session_, path("camera.json"), false).code(), StatusCode::output);
    session_->document().undo();
    EXPECT_FALSE(session_->document().can_undo());
}

TEST_F(SessionTest, TheMotionPathFollowsTheVectors) {
    open();
    settle();
    const auto path_of_ground = motion_path(*session_, 0, 0);
    ASSERT_GT(path_of_ground.size(), 2u);
    // The ground moves by (-2, 1) pixels per frame; the shutter is open for half of one.
    EXPECT_NEAR(path_of_ground.front()[0], 0.5 + 0.5, 1e-5);
    EXPECT_NEAR(path_of_ground.back()[0], 0.5 - 0.5, 1e-5);
    EXPECT_NEAR(path_of_ground.back()[1], 0.5 + 0.25, 1e-5);
}

TEST_F(SessionTest, AnyTextureOfThePlanAndTheFillMask) {
    open();
    settle();
    const auto plan = session_->shown().plan;
    int shown = 0;
    for (const PlanTexture& texture : plan->textures) {
        if (texture.imported || texture.format == Format::work_list) continue;
        session_->view().plane = texture.name;
        settle();
        ASSERT_TRUE(session_->shown().texture) << texture.name;
        EXPECT_EQ(session_->shown().texture->width, texture.width);
        EXPECT_TRUE(session_->painted().image) << texture.name;
        ++shown;
    }
    EXPECT_GT(shown, 3);
    session_->view().plane = kFillMask;
    settle();
    ASSERT_TRUE(session_->shown().texture);
    const ImageF& mask = *session_->shown().texture;
    for (size_t i = 0; i < mask.pixels(); ++i)
        ASSERT_NEAR(mask.data[4 * i] + mask.data[4 * i + 1] + mask.data[4 * i + 2], 1, 1e-4);
    for (const std::string& plane : planes_of(*session_)) {
        session_->view().plane = plane;
        settle();
        EXPECT_TRUE(session_->painted().image) << plane;
    }
}

TEST_F(SessionTest, ComparesWithTheFrameChainBAndGroundTruth) {
    fs::create_directory(path("truth"));
    fs::copy_file(path("in.0002.exr"), path("truth/in.0001.exr"));
    settings_.truth = settings_.run;
    settings_.truth->input = *io::InputSpec::parse(path("truth/in.####.exr"));
    open();
    settle();
    const ImageF as_held = *session_->shown().color;
    session_->view().compare = Compare::difference;
    session_->keep_as_other_chain();
    EXPECT_TRUE(session_->document().set(0, "samples", int64_t(2)).ok());
    const struct {
        CompareTarget target;
        ImageF other;
    } cases[] = {{CompareTarget::before, test::read_color(path("in.0001.exr"))},
                 {CompareTarget::other_chain, as_held},
                 {CompareTarget::truth, test::read_color(path("in.0002.exr"))}};
    for (const auto& [target, other] : cases) {
        session_->view().target = target;
        const Rgba expected = *painted(other, Look::color, session_->view().display);
        ASSERT_TRUE(wait_for([&] {
            const auto& shown = session_->painted().other;
            return shown && shown->data == expected.data && session_->at_rest();
        })) << int(target);
        EXPECT_FALSE(session_->painted().metrics.empty());
        EXPECT_TRUE(session_->painted().map) << int(target);
    }
}

TEST_F(SessionTest, AGroundTruthOfAnotherSizeIsNotCompared) {
    fs::create_directory(path("truth"));
    test::write_sequence(path("truth"), {1, 2, 3}, 32, 24);
    settings_.truth = settings_.run;
    settings_.truth->input = *io::InputSpec::parse(path("truth/in.####.exr"));
    open();
    session_->view().compare = Compare::wipe;
    session_->view().target = CompareTarget::truth;
    ASSERT_TRUE(wait_for([&] {
        return says(
            "ground truth: 32x24 pixels, the frame has 64x48; give one of the same "
            "size");
    }));
    settle();
    EXPECT_FALSE(session_->painted().other);
    EXPECT_TRUE(session_->painted().image);
}

TEST_F(SessionTest, ASequenceThatGrowsAndLosesFrames) {
    open();
    settle();
    test::write_sequence(folder_.path(), {4}, 64, 48);
    ASSERT_TRUE(wait_for([&] { return session_->frames().size() == 4; }));
    session_->step(-1);
    EXPECT_EQ(session_->frame(), 4);
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(4).data);
    session_->go_to(3);
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(3).data) << "with the frame after it";
    fs::remove(path("in.0002.exr"));
    ASSERT_TRUE(wait_for([&] { return session_->frames().size() == 3; }));
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(3).data) << "without the frame before it";
    // A neighbor is rendered anew.
    test::write_sequence(folder_.path(), {4}, 64, 48, {.convention = "nuke"});
    const SharedFrame former = session_->source();
    ASSERT_TRUE(wait_for([&] { return session_->source() && session_->source() != former; }));
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(3).data);
    // The frame that is shown is removed.
    fs::remove(path("in.0003.exr"));
    ASSERT_TRUE(wait_for([&] { return !session_->trouble().empty(); }));
    EXPECT_NE(session_->trouble().find("in.0003.exr: frame is not on disk"), std::string::npos)
        << session_->trouble();
    session_->go_to(4);
    settle();
    EXPECT_EQ(session_->trouble(), "");
}

TEST_F(SessionTest, AnUnreadableFrameDoesNotEndTheSession) {
    write_text(path("in.0002.exr"), "no image");
    open();
    settle();
    EXPECT_EQ(session_->picture_state(), "refined");
    session_->go_to(2);
    ASSERT_TRUE(wait_for([&] { return !session_->trouble().empty(); }));
    EXPECT_NE(session_->trouble().find("in.0002.exr"), std::string::npos);
    settle();
    EXPECT_EQ(session_->picture_state(), "of frame 1");
    session_->go_to(3);
    settle();
    EXPECT_EQ(session_->trouble(), "");
    EXPECT_TRUE(session_->shown().color);
}

TEST_F(SessionTest, AnEmptyFolderIsOpenedWhenItsFirstFrameIsThere) {
    settings_.run.input = *io::InputSpec::parse(path("later.####.exr"));
    open();
    settle();
    EXPECT_TRUE(says("later.####.exr"));
    fs::copy_file(path("in.0002.exr"), path("later.0007.exr"));
    ASSERT_TRUE(wait_for([&] { return session_->shown().color != nullptr; }));
    EXPECT_EQ(session_->frame(), 7);
}

TEST_F(SessionTest, AFrameLargerThanMemorySaysSo) {
    settings_.run.source.max_memory = 1000;
    open();
    ASSERT_TRUE(wait_for([&] { return !session_->trouble().empty(); }));
    EXPECT_NE(session_->trouble().find("memory"), std::string::npos) << session_->trouble();
}

TEST_F(SessionTest, AChainThatCannotRunKeepsThePicture) {
    open();
    settle();
    const auto before = session_->painted().image;
    // A lens that this frame does not know.
    EXPECT_TRUE(session_->document().set_camera("focal_length_mm", ParameterValue()).ok());
    ASSERT_TRUE(wait_for([&] { return !session_->trouble().empty(); }));
    EXPECT_NE(session_->trouble().find("focal_length_mm"), std::string::npos);
    settle();
    EXPECT_TRUE(session_->painted().image) << "the frame as it is";
    EXPECT_EQ(session_->picture_state(), "as before");
    session_->document().undo();
    session_->tick();
    EXPECT_EQ(session_->trouble(), "") << "the failure is of the former request";
    settle();
    EXPECT_EQ(session_->trouble(), "");
    EXPECT_EQ(session_->painted().image->data, before->data);
}

TEST_F(SessionTest, TheChainFileIsReloaded) {
    open();
    settle();
    std::string text = kJoint;
    text.replace(text.find("samples: 8"), 10, "samples: x");
    write_text(path("chain.yaml"), text);
    ASSERT_TRUE(wait_for([&] { return says("chain.yaml:5:"); })) << "the line of the fault";
    EXPECT_FALSE(session_->document().can_undo()) << "the chain stays";
    text.replace(text.find("samples: x"), 10, "samples: 16");
    write_text(path("chain.yaml"), text);
    ASSERT_TRUE(wait_for([&] { return session_->document().can_undo(); }));
    EXPECT_FALSE(session_->document().changed());
    settle();
    EXPECT_EQ(session_->shown().color->data, as_run(1).data);
    EXPECT_TRUE(session_->document().set(0, "samples", int64_t(4)).ok());
    ASSERT_TRUE(session_->save_chain(path("chain.yaml"), false).ok());
    text.replace(text.find("samples: 16"), 11, "samples: 4");
    EXPECT_EQ(test::read_text(path("chain.yaml")), text) << "comments are kept";
    EXPECT_EQ(session_->save_chain(path("in.0001.exr"), true).code(), StatusCode::usage)
        << "an input is never replaced";
    EXPECT_EQ(session_->save_chain(path("chain.json"), true).code(), StatusCode::output);
}

TEST_F(SessionTest, AChangeOfTheFileByOthersIsNotOverwritten) {
    open();
    settle();
    const std::string text = std::string(kJoint) + "# by others\n";
    write_text(path("chain.yaml"), text);
    EXPECT_TRUE(session_->document().set(0, "samples", int64_t(4)).ok());
    EXPECT_EQ(session_->save_chain(path("chain.yaml"), false).code(), StatusCode::output);
    EXPECT_EQ(test::read_text(path("chain.yaml")), text);
    EXPECT_TRUE(session_->save_chain(path("chain.yaml"), true).ok());
}

TEST_F(SessionTest, EditsOfAViewerThatWasKilledComeBack) {
    settings_.recovery_folder = path("state/view");
    const SessionSettings& given = settings_;
    const auto again = [&] {
        SessionSettings settings;
        settings.run = given.run;
        settings.chain_name = given.chain_name;
        settings.chain_is_file = true;
        settings.chain_text = kJoint;
        settings.chain = parse_chain(kJoint, "chain.yaml", builtin_passes()).chain.clone();
        settings.context = given.context;
        settings.recovery_folder = path("state/view");
        return settings;
    };
    SessionSettings second = again(), third = again(), fourth = again();
    open();
    EXPECT_TRUE(session_->document().erase(0).ok());
    EXPECT_TRUE(session_->document().set_focus_key(1, 2.5).ok());
    EXPECT_TRUE(session_->document().add("motion_blur", 0).ok());
    EXPECT_TRUE(session_->document().switch_off(0, true).ok());
    const std::string edited = session_->document().chain().text();
    ASSERT_TRUE(wait_for([&] {
        return fs::exists(path("state/view")) && !fs::is_empty(path("state/view")) &&
               std::any_of(fs::directory_iterator(path("state/view")), fs::directory_iterator(),
                           [](const auto& file) { return file.path().extension() == ".json"; });
    }));
    // A viewer beside it has edits of its own.
    settings_ = std::move(second);
    auto killed = std::move(session_);
    open();
    EXPECT_FALSE(session_->document().changed());
    session_.reset();
    // The first one ends without a word; its folder stays.
    killed.reset();
    settings_ = std::move(third);
    open();
    EXPECT_TRUE(says("restored"));
    EXPECT_EQ(session_->document().chain().text(), edited);
    EXPECT_TRUE(session_->document().state().off[0]);
    EXPECT_EQ(session_->document().state().focus_keys.at(1), 2.5);
    EXPECT_TRUE(session_->document().changed());
    session_->document().undo();
    EXPECT_FALSE(session_->document().changed()) << "one step leads back to the file";
    session_->document().redo();
    EXPECT_TRUE(session_->save_chain(path("chain.yaml"), false).ok());
    EXPECT_TRUE(save_camera(*session_, path("keys.json"), false).ok());
    session_.reset();
    settings_ = std::move(fourth);
    open();
    EXPECT_FALSE(says("restored")) << "all is saved";
}

TEST_F(SessionTest, AReloadedChainKeepsTheValuesOfSet) {
    settings_.sets = {"fxaa.mode=directional"};
    open();
    std::string text = kJoint;
    text.replace(text.find("samples: 8"), 10, "samples: 16");
    write_text(path("chain.yaml"), text);
    ASSERT_TRUE(wait_for([&] { return session_->document().can_undo(); }));
    EXPECT_NE(session_->document().chain().text().find("mode=directional"), std::string::npos)
        << session_->document().chain().text();
}

TEST_F(SessionTest, OnlyTheirOwnFilesAreReplaced) {
    write_text(path("profile.yaml"), "a profile");
    write_text(path("own.json"), "{}");
    settings_.run.other_inputs = {{path("profile.yaml"), "the profile"},
                                  {path("own.json"), "the camera file"}};
    settings_.run.source.camera = *load_camera(path("own.json"));
    open();
    settle();
    EXPECT_EQ(session_->save_chain(path("profile.yaml"), true).code(), StatusCode::usage);
    EXPECT_TRUE(session_->document().set_focus_key(1, 2).ok());
    EXPECT_EQ(save_camera(*session_, path("profile.yaml"), true).code(), StatusCode::usage);
    EXPECT_EQ(save_camera(*session_, path("own.json"), false).code(), StatusCode::usage);
    EXPECT_TRUE(session_->document().keys_changed());
    EXPECT_TRUE(save_camera(*session_, path("own.json"), true).ok());
    EXPECT_FALSE(session_->document().keys_changed());
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
            session_->step(1);
            settle();
            least = std::min(least, session_->shown().counters.textures_alive);
        }
        return least;
    };
    const auto set_f_stop = [&](double value) {
        EXPECT_TRUE(session_->document().set_camera("f_stop", value).ok());
        session_->step(1);
        settle();
    };
    set_f_stop(1.4);
    const uint64_t before = least_alive(16, 0);
    for (int i = 12; i >= 0; --i) set_f_stop(1.4 + 0.1 * i);
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
    bool line = false;
    const auto lines = std::count(text.begin(), text.end(), '\n') + 2;
    for (const Message& message : session_->messages())
        line = line || message.text.find(std::to_string(lines)) != std::string::npos;
    EXPECT_TRUE(line) << "line " << lines;
    settle();
    EXPECT_EQ(session_->shown().color->data, good->data) << "by the last good program";
    session_->clear_messages();
    write_text(file, text);
    ASSERT_TRUE(wait_for([&] { return says("shaders changed"); }));
    settle();
    EXPECT_EQ(session_->trouble(), "");
}

}  // namespace
}  // namespace postchain::view
