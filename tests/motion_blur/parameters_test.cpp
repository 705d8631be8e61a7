// The two ends of each parameter's range change the image as its help says. Effects of values in
// between are computed by hand in gather_test.cpp, jitter_test.cpp, stages_test.cpp.

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

int lit(const ImageF& image) {
    int count = 0;
    for (int x = 0; x < image.width; ++x) count += image.at(x, 20) > 0;
    return count;
}

// A fraction of the display's height: the same limit in pixels at this size, another at twice it.
TEST(Parameter, MaxBlurFraction) {
    const BlurFrame frame = spot_frame(38, 0);
    const double fraction = 12.0 / frame.height();
    for (const char* mode : {"guertin", "inverse_warp"}) {
        const Chain by_fraction =
            plain_blur({{"mode", std::string(mode)}, {"max_blur_fraction", fraction}});
        const Chain by_px =
            plain_blur({{"mode", std::string(mode)}, {"max_blur_px", int64_t(12)}});
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

TEST(Parameter, Samples) {
    const BlurFrame frame = spot_frame(30, 0);
    // One tap is at the pixel itself; 1023 leave no gap.
    EXPECT_TRUE(equal_bits(blurred(plain_blur({{"samples", int64_t(1)}}), frame), frame.color()));
    EXPECT_EQ(lit(blurred(plain_blur({{"samples", int64_t(25)}}), frame)), 25);
    EXPECT_EQ(lit(blurred(plain_blur({{"samples", int64_t(1023)}}), frame)), 61);
}

TEST(Parameter, MaxBlur) {
    const BlurFrame frame = spot_frame(30, 0);
    const auto with = [&](int64_t r) {
        return streak(blurred(plain_blur({{"max_blur_px", r}, {"samples", int64_t(255)}}), frame));
    };
    EXPECT_EQ(with(1), 1);
    EXPECT_EQ(with(12), 12);
    EXPECT_EQ(with(1024), 30);
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

TEST(Parameter, Jitter) {
    const BlurFrame frame = spot_frame(30, 0);
    const auto with = [&](double jitter, int64_t seed) {
        return blurred(blur({{"jitter", jitter}, {"tile_jitter", false}, {"seed", seed}}), frame);
    };
    EXPECT_TRUE(equal_bits(with(0, 0), with(0, 5)));
    EXPECT_FALSE(equal_bits(with(1, 0), with(1, 5)));
    // Taps 30 / 13 px apart leave gaps that are equal in all rows; jitter of a full spacing fills
    // them differently in each row.
    EXPECT_EQ(lit(with(0, 0)), 25);
    BlurFrame line = frame;
    for (int y = 0; y < 41; ++y) line.set_gray(60, y, 1);
    const ImageF out = blurred(blur({{"jitter", 1.0}, {"tile_jitter", false}}), line);
    int reached = 0;
    for (int x = 0; x < 121; ++x) {
        bool any = false;
        for (int y = 0; y < 41; ++y) any = any || out.at(x, y) > 0;
        reached += any;
    }
    EXPECT_GE(reached, 57);
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

TEST(Parameter, CenterWeight) {
    // Uniform 4 px, N = 3 (gather_test.cpp): the spot keeps 1 - 6 / (10 + 3 / (4 kappa)).
    const BlurFrame frame = spot_frame(4, 0);
    for (const double kappa : {0.1, 40.0, 10000.0}) {
        const ImageF out =
            blurred(plain_blur({{"samples", int64_t(3)}, {"center_weight", kappa}}), frame);
        expect_pixel(out, 60, 20, {1 - 6 / (10 + 0.75 / kappa)});
    }
}

TEST(Parameter, VarianceThreshold) {
    // A pixel at 2 px across a dominant 6 px. gamma 0.01: its taps go along its own motion and
    // reach the red above and below it; gamma 100: they go across w_max, which is the same line
    // here ...
    BlurFrame frame(41, 41);
    frame.set_all_half_velocities(6, 0);
    const double v = 2 * std::sqrt(0.5);
    for (int y = 18; y <= 22; ++y)
        for (int x = 18; x <= 22; ++x) frame.set_half_velocity(x, y, v, v);
    frame.color().at(21, 21, 0) = 1;  // along (1, 1): its own direction
    frame.color().at(20, 21, 1) = 1;  // along (0, 1): across w_max
    const auto with = [&](double gamma) {
        return blurred(plain_blur({{"variance_threshold_px", gamma}}), frame);
    };
    const ImageF own = with(0.01), across = with(100);
    EXPECT_GT(own.at(20, 20, 0), 0);
    EXPECT_EQ(own.at(20, 20, 1), 0);
    EXPECT_EQ(across.at(20, 20, 0), 0);
    EXPECT_GT(across.at(20, 20, 1), 0);
}

TEST(Parameter, DepthSoftness) {
    // White ground behind a black moving pixel column at a depth ratio of 1.02.
    BlurFrame frame = spot_frame(6, 0);
    BlurFrame flat = frame;
    frame.depth().at(60, 20) = 1.02f;
    const auto with = [&](double s, const BlurFrame& f) {
        return blurred(plain_blur({{"depth_softness", s}}), f);
    };
    EXPECT_TRUE(equal_bits(with(0, frame), with(0, flat)));
    EXPECT_FALSE(equal_bits(with(1, frame), with(1, flat)));
    // s = 100: 1 - 100 * 0.02 < 0, as occluded as at any larger ratio.
    BlurFrame far = frame;
    far.depth().at(60, 20) = 5;
    EXPECT_TRUE(equal_bits(with(100, frame), with(100, far)));
    EXPECT_FALSE(equal_bits(with(1, frame), with(1, far)));
}

TEST(Parameter, ChoicesAndSwitches) {
    BlurFrame frame = random_frame(90, 70, 14, 1.5f, 61);
    const auto picture = [&](const Values& values) {
        Values all = {{"max_blur_px", int64_t(16)}};
        all.insert(all.end(), values.begin(), values.end());
        return blurred(blur(all), frame);
    };
    // Two values of each give two images ...
    const std::pair<const char*, std::vector<ParameterValue>> rows[] = {
        {"mode", {"guertin", "single"}},
        {"sample_split", {"even", "variance"}},
        {"noise", {"halton", "ign", "blue", "none"}},
        {"border", {"skip", "clamp"}},
        {"tile_jitter", {true, false}},
        {"animate_noise", {true, false}},
        {"seed", {int64_t(0), int64_t(2147483647)}},
        {"velocity_storage", {"fp16", "fp32", "unorm8"}},
    };
    for (const auto& [key, values] : rows)
        for (size_t i = 0; i < values.size(); ++i)
            for (size_t j = 0; j < i; ++j)
                EXPECT_FALSE(equal_bits(picture({{key, values[i]}}), picture({{key, values[j]}})))
                    << key << " " << text_of(values[i]) << " " << text_of(values[j]);
    // ... and these give equal images.
    EXPECT_TRUE(equal_bits(picture({{"noise", "none"}}),
                           picture({{"jitter", 0.0}, {"tile_jitter", false}})));
    // Without storage, a velocity longer than 16 px is clamped differently.
    const ImageF in_place = picture({{"velocity_storage", "auto"}});
    const ImageF stored = picture({{"velocity_storage", "fp32"}});
    EXPECT_EQ(compare(in_place, stored, 1e-5).fraction, 0);
    frame = random_frame(90, 70, 10, 1.5f, 61);
    EXPECT_TRUE(equal_bits(picture({{"velocity_storage", "auto"}}),
                           picture({{"velocity_storage", "fp32"}})));
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

// A still pixel in fast surroundings, with a lamp above and one beside it, both slow enough to
// count only along the taps: across the dominant motion, or along it.
TEST(Parameter, StaticDirection) {
    BlurFrame frame(31, 31);
    frame.set_all_half_velocities(0, 6);  // dominant is vertical
    for (int x = 0; x < 31; ++x) frame.set_half_velocity(x, 15, 0, 0);
    for (int x : {14, 16}) {
        frame.set_gray(x, 15, 1);
        frame.set_half_velocity(x, 15, 6, 0);  // moves over the still pixel from the side
    }
    const auto at = [&](const char* direction) {
        return blurred(plain_blur({{"static_direction", direction}}), frame).at(15, 15);
    };
    EXPECT_GT(at("perpendicular"), 0.05);
    EXPECT_EQ(at("dominant"), 0);
}

TEST(Parameter, MinSpeed) {
    BlurFrame frame = spot_frame(0.1, 0);
    const auto gate = [&](double limit) {
        return stages_of(plain_blur({{"min_speed_px", limit}}), frame)["hint"].at(60, 20, 0);
    };
    EXPECT_EQ(gate(0), 1);
    EXPECT_EQ(gate(0.5), 0);
    frame.set_all_half_velocities(39, 0);
    EXPECT_EQ(gate(0.5), 1);
    EXPECT_TRUE(equal_bits(blurred(plain_blur({{"min_speed_px", 100.0}}), frame), frame.color()));
}

}  // namespace
}  // namespace postchain::test
