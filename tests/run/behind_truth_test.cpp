// The layer behind of a generated scene brings frames closer to ground truth.
#include <gtest/gtest.h>

#include "tests/run/fixture.h"
#include "tests/run/scene_files.h"
#include "tools/metrics/display.h"
#include "tools/metrics/pair.h"

namespace postchain::sequence {
namespace {

class BehindTruthTest : public SequenceTest {
  protected:
    double psnr_to(const char* truth) {
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        const auto pair = metrics::pair_of(test::read_color(out(2)),
                                           test::read_color(truth_file("crossing", truth)));
        return metrics::psnr(*pair).value_or(0);
    }
    // PSNR with the layer minus PSNR without, dB.
    double gain(const char* pass, test::Settings values, const char* truth) {
        settings_.input = *io::InputSpec::parse(scene_file("crossing", "sharp.####.exr"));
        settings_.on_existing = io::OnExisting::overwrite;
        settings_.source.camera = *load_camera(scene_file("crossing", "camera.json"));
        frames("2");
        chain_ = test::chain_of(pass, values);
        const double without = psnr_to(truth);
        settings_.input.patterns.insert_or_assign(
            Role::behind, *io::PathPattern::parse(scene_file("crossing", "behind.####.exr")));
        return psnr_to(truth) - without;
    }
};

TEST_F(BehindTruthTest, FramesComeCloser) {
    EXPECT_GT(gain("joint_blur", {{"samples", int64_t(64)}}, "both.0002.exr"), 0.3);
    EXPECT_GT(gain("motion_blur", {{"mode", "inverse_warp"}}, "mb.0002.exr"), 0.15);
}

}  // namespace
}  // namespace postchain::sequence
