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
        ASSERT_EQ((*pass)->cuts().size(), 1u) << mode;
        EXPECT_EQ((*pass)->cuts()[0].parameter, "max_blur_fraction");
        EXPECT_DOUBLE_EQ((*pass)->cuts()[0].limit_px, 24);
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

// Tiles of 8 px; only the last column of tiles moves. The hint's first gate shows the tile used.
ImageF gates(const Values& values) {
    BlurFrame frame(64, 64);
    for (int y = 0; y < 64; ++y)
        for (int x = 56; x < 64; ++x) frame.set_half_velocity(x, y, 3, 0);
    Values all = {{"max_blur_px", int64_t(8)}, {"noise", "blue"}};
    all.insert(all.end(), values.begin(), values.end());
    return stages_of(blur(all), frame)["hint"];
}

TEST(Parameter, TileJitterAndSlope) {
    const ImageF off = gates({{"tile_jitter", false}});
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) ASSERT_EQ(off.at(x, y, 0), x >= 48) << x << "," << y;
    // Slope 100: the probability is 0 from 0.005 tiles on, and no pixel center is closer.
    EXPECT_TRUE(equal_bits(off, gates({{"tile_jitter_slope", 100.0}})));
    // Slope 0: half of the pixels use the neighbor, wherever they are. In tile column 5, pixels
    // closest to the right border (a quarter of the tile) may use column 6: half of them do.
    const ImageF flat = gates({{"tile_jitter_slope", 0.0}});
    const ImageF steep = gates({{"tile_jitter_slope", 1.0}});
    int flat_taken = 0, steep_taken = 0;
    for (int y = 0; y < 64; ++y) {
        for (int x = 40; x < 48; ++x) {
            flat_taken += flat.at(x, y, 0) == 1;
            steep_taken += steep.at(x, y, 0) == 1;
        }
    }
    // 64 x 8 pixels, a quarter of them (20 of 64 with ties going to x), half of those: 80.
    EXPECT_NEAR(flat_taken, 80, 15);
    EXPECT_GT(steep_taken, 20);
    EXPECT_LT(steep_taken, flat_taken);
}

TEST(Parameter, AnimateNoise) {
    const BlurFrame frame = random_frame(70, 50, 14, 1.5f, 62);
    const auto at = [&](int number, bool animate) {
        FrameDescription description = describe(frame.planes);
        description.frame_number = number;
        return filter(blur({{"animate_noise", animate}}), description, frame.planes)[Role::color];
    };
    EXPECT_TRUE(equal_bits(at(1, false), at(2, false)));
    EXPECT_FALSE(equal_bits(at(1, true), at(2, true)));
    EXPECT_TRUE(equal_bits(at(2, true), at(2, true)));
}

}  // namespace
}  // namespace postchain::test
