// Parameters at both ends of their range. Effects of values in between are computed by hand in
// gather_test.cpp, jitter_test.cpp, stages_test.cpp; that each has one is tests/conformance's.

#include <cmath>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

// A bright spot at (60, 20) of 121 x 41 pixels in uniform motion.
BlurFrame spot_frame(double vx, double vy) {
    BlurFrame frame(121, 41);
    frame.set_all_half_velocities(vx, vy);
    frame.set_gray(60, 20, 1);
    return frame;
}

// Half-length of the spot's streak along x.
int streak(const ImageF& image) {
    int reach = -1;
    for (int x = 60; x < image.width; ++x)
        if (image.at(x, 20) > 0) reach = x - 60;
    return reach;
}

// A fraction of the display's height: the same limit in pixels at this size, another at twice it.
TEST(Parameter, MaxBlurFraction) {
    const BlurFrame frame = spot_frame(38, 0);
    const double fraction = 12.0 / frame.height();
    for (const char* mode : {"guertin", "inverse_warp"}) {
        const Chain by_fraction =
            plain_blur({{"mode", std::string(mode)}, {"max_blur_fraction", fraction}});
        const Chain by_px = plain_blur({{"mode", std::string(mode)}, {"max_blur_px", int64_t(12)}});
        EXPECT_TRUE(equal_bits(blurred(by_fraction, frame), blurred(by_px, frame))) << mode;
        EXPECT_LE(streak(blurred(by_fraction, frame)), 13);
        FrameDescription larger = describe(frame.planes);
        larger.display_height *= 2;
        auto pass = by_fraction.links[0].pass->resolve(larger);
        ASSERT_TRUE(pass.ok());
        ASSERT_EQ((*pass)->exceeded_limits().size(), 1u) << mode;
        EXPECT_EQ((*pass)->exceeded_limits()[0].parameter, "max_blur_fraction");
        EXPECT_DOUBLE_EQ((*pass)->exceeded_limits()[0].limit_px, 24);
    }
}

TEST(Parameter, Shutter) {
    const BlurFrame frame = spot_frame(2, 0);  // 8 px per frame
    const auto with = [&](const char* key, double value) {
        return blurred(plain_blur({{key, value}, {"samples", int64_t(255)}}), frame);
    };
    EXPECT_TRUE(equal_bits(with("shutter_frames", 0.0), frame.color()));
    EXPECT_EQ(streak(with("shutter_frames", 10.0)), 40);
    EXPECT_TRUE(equal_bits(with("shutter_angle_deg", 0.0), frame.color()));
    EXPECT_TRUE(equal_bits(with("shutter_angle_deg", 3600.0), with("shutter_frames", 10.0)));
    EXPECT_TRUE(equal_bits(with("shutter_angle_deg", 180.0), with("shutter_frames", 0.5)));
}

}  // namespace
}  // namespace postchain::test
