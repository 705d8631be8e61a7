// A sequence in a folder of its own: in.####.exr is filtered into out/o.####.exr.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/command/frames.h"
#include "tests/support/gpu.h"
#include "tools/sequence/run/run_sequence.h"

namespace postchain::sequence {

class SequenceTest : public testing::Test {
  protected:
    void SetUp() override {
        std::filesystem::create_directory(at("out"));
        input("in.####.exr");
        settings_.output = *io::PathPattern::parse(at("out/o.####.exr"));
        settings_.version = "test";
    }
    // A run closes every file, also those that it cannot read or write.
    ~SequenceTest() override {
        std::error_code ignored;
        for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
            EXPECT_FALSE(
                std::filesystem::read_symlink(entry, ignored).string().starts_with(folder_.path()))
                << std::filesystem::read_symlink(entry, ignored);
    }

    std::string at(const std::string& name) const { return folder_.path(name); }
    std::string in(int frame) const { return settings_.input.color().format(frame); }
    std::string out(int frame) const { return settings_.output.format(frame); }
    void input(const std::string& name) {
        auto spec = io::InputSpec::parse(at(name));
        ASSERT_TRUE(spec.ok());
        settings_.input = *spec;
    }
    void frames(const char* text) { settings_.frames = *io::FrameRange::parse(text); }
    Result<RunSummary> go(const FrameObserver& observer = {},
                          const std::atomic<bool>* stop = nullptr) {
        return run_sequence(chain_, settings_, test::executor(), "renderer", {observer, stop});
    }
    // The report on a run's last frame, or the run's error.
    FrameReport last_frame() {
        FrameReport last;
        const auto summary =
            go([&](const FrameReport& report, const RunProgress&) { last = report; });
        if (!summary.ok()) last.status = summary.status();
        return last;
    }
    // The message of a run that must fail.
    std::string failure() {
        const FrameReport report = last_frame();
        EXPECT_FALSE(report.status.ok());
        return report.status.message();
    }
    nlohmann::json sidecar(int frame) const {
        return nlohmann::json::parse(test::read_text(out(frame) + ".json"), nullptr, false);
    }

    test::TempFolder folder_;
    Chain chain_;
    RunSettings settings_;
};

}  // namespace postchain::sequence
