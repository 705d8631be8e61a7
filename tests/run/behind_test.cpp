// `--behind`: the layer behind of a generated scene brings frames closer to ground truth; files
// that do not fit are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/run/fixture.h"
#include "tests/run/scene_files.h"
#include "tools/measure/metrics/display.h"
#include "tools/measure/metrics/pair.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class BehindTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.input = *io::InputSpec::parse(scene_file("crossing", "sharp.####.exr"));
        settings_.on_existing = io::OnExisting::overwrite;
        settings_.source.camera = *load_camera(scene_file("crossing", "camera.json"));
        frames("2");
        blur("joint_blur", {{"samples", int64_t(8)}});
    }
    void blur(const char* pass, test::Settings values) { chain_ = test::chain_of(pass, values); }
    void behind(const std::string& path) {
        settings_.input.patterns.insert_or_assign(Role::behind, *io::PathPattern::parse(path));
    }
    void behind_of_frame_2() {
        fs::copy_file(scene_file("crossing", "behind.0002.exr"), at("behind.0002.exr"));
        behind(at("behind.####.exr"));
    }
    double psnr_to(const char* truth) {
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        const auto pair = metrics::pair_of(test::read_color(out(2)),
                                           test::read_color(truth_file("crossing", truth)));
        return metrics::psnr(*pair).value_or(0);
    }
    // Without and with the layer, dB.
    std::array<double, 2> gain(const char* truth) {
        settings_.input.patterns.erase(Role::behind);
        const double without = psnr_to(truth);
        behind(scene_file("crossing", "behind.####.exr"));
        const std::array<double, 2> both = {without, psnr_to(truth)};
        RecordProperty(truth, concat(both[0], " -> ", both[1], " dB"));
        return both;
    }
};

TEST_F(BehindTest, BringsTheFrameCloserToGroundTruth) {
    blur("joint_blur", {{"samples", int64_t(64)}});
    const auto both = gain("both.0002.exr");
    EXPECT_GT(both[1], both[0] + 0.3);
    blur("motion_blur", {{"mode", "inverse_warp"}});
    const auto shutter = gain("mb.0002.exr");
    EXPECT_GT(shutter[1], shutter[0] + 0.15);
}

// Neighbors need none of their own, and do not wait for one.
TEST_F(BehindTest, IsReadAndWaitedForOnlyForTheFrameItself) {
    behind_of_frame_2();
    for (const auto& watch : {std::optional<Watch>(), std::optional(Watch{.idle_s = 10})}) {
        settings_.watch = watch;
        EXPECT_TRUE(last_frame().status.ok());
        const auto written = sidecar(2);
        EXPECT_FALSE(written["plan"].contains("missing_neighbors")) << written["plan"];
        EXPECT_EQ(written["inputs"].size(), 4u) << written["inputs"];
        EXPECT_EQ(written["inputs"]["behind"], at("behind.0002.exr"));
    }
    frames("2-3");
    settings_.watch = Watch{.idle_s = 1};
    EXPECT_THAT(failure(), HasSubstr("behind.0003.exr: frame did not come"));
}

TEST_F(BehindTest, IsNotReplaced) {
    behind_of_frame_2();
    settings_.output = *io::PathPattern::parse(at("behind.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("would replace the layer behind"));
}

TEST_F(BehindTest, DecidesWhatIsMadeAgain) {
    EXPECT_TRUE(last_frame().status.ok());
    settings_.on_existing = io::OnExisting::skip;
    EXPECT_EQ(last_frame().outcome, Outcome::skipped);
    behind(scene_file("crossing", "behind.####.exr"));
    EXPECT_EQ(last_frame().outcome, Outcome::written);
    EXPECT_EQ(last_frame().outcome, Outcome::skipped);
}

TEST_F(BehindTest, IsLeftAloneByChainsThatDoNotReadIt) {
    blur("fxaa", {});
    behind(scene_file("crossing", "behind.####.exr"));
    const FrameReport report = last_frame();
    EXPECT_TRUE(report.status.ok());
    EXPECT_THAT(report.warnings, ::testing::Contains(HasSubstr("behind.0002.exr: not read")));
    EXPECT_THAT(sidecar(2).dump(), ::testing::Not(HasSubstr("second_surfaces")));
}

TEST_F(BehindTest, FindingsInItsPixelsAreWarnings) {
    test::Planes planes = test::make_planes(160, 90);
    planes.color.at(30, 20) = NAN;
    test::write_frame(at("nan.0002.exr"), planes);
    behind(at("nan.####.exr"));
    const FrameReport report = last_frame();
    EXPECT_TRUE(report.status.ok()) << report.status.message();
    EXPECT_THAT(report.warnings,
                ::testing::Contains(HasSubstr("the first non-finite pixel is (30, 20)")));
}

TEST_F(BehindTest, FilesThatDoNotFitAreRefused) {
    behind(at("none.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("none.0002.exr: 1 of the requested frames are not on disk"));
    behind(truth_file("crossing", "both.####.exr"));
    EXPECT_THAT(failure(),
                HasSubstr("both.0002.exr: the layer behind has no inverse_depth, motion"));
    test::write_frame(at("small.0002.exr"), test::make_planes(48, 32));
    behind(at("small.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("small.0002.exr: the layer behind has display window"));
}

}  // namespace
}  // namespace postchain::sequence
