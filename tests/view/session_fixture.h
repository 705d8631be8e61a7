// A session without a window on three small frames.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/apps/view/session.h"
#include "tools/sequence/run/run_sequence.h"

namespace postchain::view {

inline constexpr const char* kJoint =
    "# joint\npostchain: 1\n"
    "camera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, focus_distance: 2,"
    " meters_per_unit: 0.05, shutter_frames: 0.5}\n"
    "passes:\n  - joint_blur: {samples: 8}\n  - fxaa\n";
inline constexpr auto kPatience = std::chrono::minutes(10);

class SessionTest : public testing::Test {
  protected:
    void SetUp() override {
        write_frames({1, 2, 3});
        test::write_text(path("chain.yaml"), kJoint);
        settings_ = given_settings();
    }
    SessionSettings given_settings() const {
        SessionSettings settings;
        settings.run.input = frames_of("in.####.exr");
        settings.run.version = "test";
        settings.open.name = path("chain.yaml");
        settings.open.is_file = true;
        settings.open.text = kJoint;
        settings.open.chain = parse_chain(kJoint, "chain.yaml", builtin_passes()).chain.clone();
        settings.context.device = egl::ContextOptions::kSoftware;
        return settings;
    }
    void write_frames(const std::vector<int>& frames, const test::FrameFile& file = {}) {
        test::write_sequence(folder_.path(), frames, 64, 48, file);
    }
    io::InputSpec frames_of(const std::string& pattern) const {
        return *io::InputSpec::parse(path(pattern));
    }
    void open() {
        auto session = Session::open(std::move(settings_), [] {});
        ASSERT_TRUE(session.ok()) << session.status().message();
        session_ = std::move(*session);
    }
    bool wait_for(const std::function<bool()>& holds) {
        const auto end = Clock::now() + kPatience;
        while (Clock::now() < end) {
            session_->tick();
            if (holds()) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        return false;
    }
    void settle() {
        ASSERT_TRUE(wait_for([&] { return session_->at_rest(); })) << session_->trouble();
    }
    void expect_trouble(const std::string& words) {
        ASSERT_TRUE(wait_for([&] { return !session_->trouble().empty(); }));
        EXPECT_THAT(session_->trouble(), testing::HasSubstr(words));
    }
    // When nothing is under way, the picture is the one that `run` writes of this frame.
    void expect_run_of(int frame, const char* when = "") {
        settle();
        EXPECT_FALSE(session_->shown().draft) << when;
        EXPECT_EQ(session_->shown().frame, frame) << when;
        EXPECT_EQ(session_->shown().color->data, as_run(frame).data) << when;
    }
    bool says(const std::string& text) const {
        for (const Message& message : session_->messages().list())
            if (message.text.find(text) != std::string::npos) return true;
        return false;
    }
    std::string path(const std::string& name) const { return folder_.path(name); }
    Document& document() { return session_->document(); }
    // The color that `run` writes with the session's chain.
    ImageF as_run(int frame) {
        std::filesystem::create_directories(path("run"));
        sequence::RunSettings settings = session_->settings().run;
        settings.output = *io::PathPattern::parse(path("run/o.####.exr"));
        settings.on_existing = io::OnExisting::overwrite;
        settings.frames = io::FrameRange{{frame}};
        egl::ContextOptions options;
        options.device = egl::ContextOptions::kSoftware;
        auto context = egl::Context::create(options);
        EXPECT_TRUE(context.ok());
        Executor executor((*context)->device());
        const auto summary = sequence::run_sequence(session_->document().chain_at(frame), settings,
                                                    executor, "", {});
        EXPECT_TRUE(summary.ok() && summary->failed == 0);
        return test::read_color(settings.output.format(frame));
    }

    test::TempFolder folder_;
    SessionSettings settings_;
    std::unique_ptr<Session> session_;
};

}  // namespace postchain::view
