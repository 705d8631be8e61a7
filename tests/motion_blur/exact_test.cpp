// Exact properties of any motion blur of this kind.

#include <array>
#include <cmath>
#include <limits>

#include "chain/convert.h"
#include "chain/plan_print.h"
#include "passes/motion_blur/parameters.h"
#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

const std::vector<Values>& many_settings() {
    static const std::vector<Values> settings = {
        {},
        {{"mode", "single"}},
        {{"sample_split", "variance"}, {"noise", "blue"}},
        {{"border", "clamp"}, {"noise", "ign"}, {"tile_jitter_slope", 0.0}},
        {{"max_blur_px", int64_t(7)}, {"depth_softness", 20.0}},
        {{"static_direction", "dominant"}, {"velocity_storage", "unorm8"}},
        {{"center_weight", 10000.0}, {"samples", int64_t(1)}},
        {{"min_speed_px", 0.0}},
    };
    return settings;
}

TEST(Exact, ConstantColorStays) {
    BlurFrame frame = random_frame(90, 70, 30, 1.5f, 31);
    frame.color() = constant_image(90, 70, {0.1f, 7.3f, 1e-4f, 0.7f});
    for (const Values& values : many_settings())
        EXPECT_TRUE(equal_bits(blurred(blur(values), frame), frame.color()));
}

TEST(Exact, NoMotionReturnsEveryBit) {
    BlurFrame frame = random_frame(90, 70, 0, 1.5f, 32);
    frame.color().at(3, 3, 0) = -0.0f;
    frame.color().at(4, 3, 0) = 1e-40f;  // subnormal
    for (const Values& values : many_settings())
        EXPECT_TRUE(equal_bits(blurred(blur(values), frame), frame.color()));
}

// Half-velocities of at most 0.5 px: identity() is true, and the result equals the input bit for
// bit in any storage.
TEST(Exact, IdentityByFactsIsTrue) {
    BlurFrame frame = random_frame(80, 60, 0.5f, 1.5f, 33);
    for (int y = 0; y < 60; ++y) {
        for (int x = 0; x < 80; ++x) {  // onto the circle of 2 px/frame, rounded inwards
            float* m = frame.motion().pixel(x, y);
            const double length = std::hypot(double(m[0]), double(m[1]));
            for (int c = 0; c < 2; ++c) m[c] = float(m[c] * 1.9999998 / length);
        }
    }
    for (const char* storage : {"auto", "fp32", "fp16", "unorm8"}) {
        const Chain chain = blur({{"velocity_storage", storage}});
        Plan plan;
        filter(chain, describe(frame.planes), frame.planes, {}, &plan);
        ASSERT_TRUE(plan.passes[0].elided) << plan_as_text(plan);
        EXPECT_TRUE(equal_bits(blurred(chain, frame), frame.color())) << storage;
    }
}

TEST(Exact, LongVectorsKeepTheirDirection) {
    BlurFrame frame(40, 1);
    for (int x = 0; x < 40; ++x) {
        const double angle = 2 * M_PI * (x + 0.3) / 40, length = std::pow(10.0, 2 + x % 15);
        frame.set_half_velocity(x, 0, length * std::cos(angle), length * std::sin(angle));
    }
    const Chain chain = plain_blur({{"max_blur_px", int64_t(40)}, {"velocity_storage", "fp32"}});
    const ImageF v = stages_of(chain, frame)["half_velocity"];
    for (int x = 0; x < 40; ++x) {
        const double angle = 2 * M_PI * (x + 0.3) / 40;
        expect_pixel(v, x, 0, {40 * std::cos(angle), 40 * std::sin(angle)}, 1e-6);
    }
}

// A bright point in uniform motion: its streak covers exactly the pixels within half of its path
// while the shutter is open.
TEST(Exact, StreakLengthIsMotionTimesShutter) {
    for (const double shutter : {0.25, 0.5, 1.0}) {
        for (const auto& [mx, my] : {std::pair(24.0, 0.0), {0.0, 24.0}, {24.0, 24.0}}) {
            BlurFrame frame(101, 101);
            for (size_t i = 0; i < frame.motion().pixels(); ++i) {
                frame.motion().data[2 * i] = float(mx);
                frame.motion().data[2 * i + 1] = float(my);
            }
            frame.set_gray(50, 50, 1);
            const ImageF out = blurred(
                plain_blur({{"samples", int64_t(255)}, {"shutter_frames", shutter}}), frame);
            const int half_x = int(mx * shutter / 2), half_y = int(my * shutter / 2);
            int lit = 0, left = 101, right = -1, top = 101, bottom = -1;
            for (int y = 0; y < 101; ++y) {
                for (int x = 0; x < 101; ++x) {
                    if (out.at(x, y, 0) == 0) continue;
                    ++lit;
                    left = std::min(left, x), right = std::max(right, x);
                    top = std::min(top, y), bottom = std::max(bottom, y);
                }
            }
            EXPECT_EQ(left, 50 - half_x);
            EXPECT_EQ(right, 50 + half_x);
            EXPECT_EQ(top, 50 - half_y);
            EXPECT_EQ(bottom, 50 + half_y);
            EXPECT_EQ(lit, 2 * std::max(half_x, half_y) + 1) << "no gaps";
        }
    }
}

BlurFrame square_frame(double near_v, double far_v, float near_w, int size = 120) {
    BlurFrame frame(size, size);
    frame.set_all_half_velocities(0, far_v);
    for (int y = size / 3; y < 2 * size / 3; ++y) {
        for (int x = size / 3; x < 2 * size / 3; ++x) {
            frame.set_gray(x, y, 1);
            frame.set_half_velocity(x, y, near_v, 0);
            frame.depth().at(x, y) = near_w;
        }
    }
    return frame;
}

TEST(Exact, MovingSquareSpreadsOutsideItsSilhouette) {
    const BlurFrame frame = square_frame(10, 0, 2);
    const ImageF out = blurred(plain_blur(), frame);
    for (int x = 31; x < 40; ++x) EXPECT_GT(out.at(x, 60, 0), 0) << x;
    for (int x = 80; x < 89; ++x) EXPECT_GT(out.at(x, 60, 0), 0) << x;
    EXPECT_EQ(out.at(28, 60, 0), 0);  // beyond the half-streak
    EXPECT_EQ(out.at(60, 38, 0), 0);  // across the motion
    EXPECT_LT(out.at(41, 60, 0), 1);  // and the ground shows through its edge
    EXPECT_EQ(out.at(60, 60, 0), 1);
}

// Static square, moving ground, N = 25: the first taps are at T = |v_max| / 13. At 8 px that is
// 0.615, outside the range in which the cylinder ignores depth: every bit of the square stays.
TEST(Exact, StaticSquareBeforeMovingGround) {
    for (const auto& [ratio, softness] : {std::pair(2.0f, 1.0), {1.2f, 20.0}}) {
        for (const char* noise : {"none", "halton"}) {
            BlurFrame frame = square_frame(0, 8, ratio);
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 120; ++x)
                    frame.color().at(x, y, 1) = float((3 * x + 7 * y) % 11);
            const ImageF before = frame.color();
            const ImageF out = blurred(blur({{"noise", noise},
                                             {"jitter", 0.0},
                                             {"tile_jitter", false},
                                             {"depth_softness", softness}}),
                                       frame);
            int changed_ground = 0;
            for (int y = 0; y < 120; ++y) {
                for (int x = 0; x < 120; ++x) {
                    const bool inside = x >= 40 && x < 80 && y >= 40 && y < 80;
                    const bool same = out.at(x, y, 1) == before.at(x, y, 1) &&
                                      out.at(x, y, 0) == before.at(x, y, 0);
                    if (inside)
                        ASSERT_TRUE(same) << x << "," << y;
                    else
                        changed_ground += !same;
                }
            }
            EXPECT_GT(changed_ground, 5000);
        }
    }
}

// At 6.6 px the taps next to the center are at T = 0.50769. w_max is vertical; these two taps (i =
// 11 and 13, odd) go along w_c = w_p, sideways, w_A = 1: weight 2 cylinder(0.50769, 0.5) = 0.5532
// each (x = 0.65385, smoothstep 0.72342); they round to the pixels left and right. total = 25 / 20
// = 1.25, all else is 0. Only the square's left and right columns see ground: 0.5532 / (1.25 +
// 1.1063).
TEST(Exact, CylinderLeakOfAStaticSquareIsBounded) {
    const BlurFrame frame = square_frame(0, 6.6, 2);
    const ImageF out = blurred(plain_blur(), frame);
    const double x = (6.6 / 13 - 0.475) / 0.05, leak = 2 * (1 - x * x * (3 - 2 * x));
    for (int y = 40; y < 80; ++y) {
        for (int px = 40; px < 80; ++px) {
            const double expected = px == 40 || px == 79 ? 1 - leak / (1.25 + 2 * leak) : 1;
            expect_pixel(out, px, y, {expected}, 1e-4);
        }
    }
}

double centroid_x(const ImageF& image) {
    double sum = 0, moment = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            sum += image.at(x, y, 0);
            moment += double(image.at(x, y, 0)) * x;
        }
    }
    return moment / sum;
}

TEST(Exact, CentroidOfABlurredDotStays) {
    for (const double v : {3.3, 10.7, 31.9}) {
        // On ground that moves with it ...
        BlurFrame frame(121, 121);
        frame.set_all_half_velocities(v, 0.37 * v);
        frame.set_gray(60, 60, 1);
        EXPECT_NEAR(centroid_x(blurred(plain_blur(), frame)), 60, 1e-4) << v;
        // ... and separately before still ground.
        BlurFrame alone(121, 121);
        for (int y = 59; y <= 61; ++y) {
            for (int x = 59; x <= 61; ++x) {
                alone.set_gray(x, y, 1);
                alone.set_half_velocity(x, y, v, 0.37 * v);
                alone.depth().at(x, y) = 2;
            }
        }
        EXPECT_NEAR(centroid_x(blurred(plain_blur(), alone)), 60, 1e-4) << v;
    }
}

// Bad values are replaced and counted at the border of the chain; results are finite.
TEST(Exact, NonfiniteInputGivesFiniteOutputAndACount) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    BlurFrame frame = random_frame(60, 50, 9, 1.5f, 41);
    const float bad[3] = {nan, inf, -inf};
    for (int i = 0; i < 3; ++i) {
        frame.color().at(10 + i, 10, i) = bad[i];
        frame.depth().at(20 + i, 20) = bad[i];
        frame.motion().at(30 + i, 30, i % 2) = bad[i];
    }
    FrameDescription description = describe(frame.planes);
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    const auto health = convert_frame(frame.planes, description, options);
    ASSERT_TRUE(health.ok());
    EXPECT_EQ(health->nonfinite_color, 3u);
    EXPECT_EQ(health->nonfinite_depth, 3u);
    EXPECT_EQ(health->nonfinite_motion + health->sentinel_motion, 3u);
    const FramePlanes out = filter(blur(), description, frame.planes);
    for (float value : out.at(Role::color).data) ASSERT_TRUE(std::isfinite(value));
}

// An engine may provide unscanned textures: bad motion counts as zero, bad depth as some depth, and
// neither makes a pixel non-finite.
TEST(Exact, UnscannedMotionAndDepthStayFinite) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    BlurFrame frame = random_frame(60, 50, 9, 1.5f, 42);
    const FrameDescription description = describe(frame.planes);
    const float bad[5] = {nan, inf, -inf, 3e38f, -3e38f};
    for (int i = 0; i < 5; ++i) {
        frame.depth().at(20 + i, 20) = bad[i];
        frame.motion().at(30 + i, 30, i % 2) = bad[i];
    }
    const FramePlanes out = filter(blur(), description, frame.planes);
    for (float value : out.at(Role::color).data) ASSERT_TRUE(std::isfinite(value));
}

// Vectors of 1e30 px are cut like any that are longer than max_blur_px.
TEST(Exact, HugeMotionIsCutAndNotIgnored) {
    for (const char* mode : {"guertin", "single", "inverse_warp"}) {
        const auto with = [&](float speed, float cross) {
            BlurFrame frame = random_frame(90, 70, 0, 1.5f, 44);
            for (int y = 20; y < 50; ++y)
                for (int x = 20; x < 60; ++x) {
                    frame.motion().at(x, y, 0) = speed;
                    frame.motion().at(x, y, 1) = cross;
                }
            return frame;
        };
        const Chain chain = blur({{"mode", mode}, {"max_blur_px", int64_t(16)}});
        const ImageF fast = blurred(chain, with(4000, 0));
        EXPECT_GT(compare(fast, with(0, 0).color(), 0.01).fraction, 0.1) << mode;
        for (const float speed : {1e18f, 1e30f, 3e38f})
            EXPECT_LE(compare(blurred(chain, with(speed, 0)), fast, 1e-4).fraction, 0.002)
                << mode << " " << speed;
        const Difference difference =
            compare(blurred(chain, with(1e30f, -1e30f)),
                    reference_stages_of(chain, with(1e30f, -1e30f)).at("color"), 1e-3);
        EXPECT_LE(difference.fraction, 0.01) << mode << ": " << difference.text;
    }
}

// The default follows the picture: a streak of 130 px at 1920 pixels is not cut, and at 640 the
// report's 40 px remain.
TEST(Exact, MaxBlurFollowsTheWidth) {
    FrameDescription frame;
    for (const auto& [width, tile, path] :
         {std::array{320, 40, 40}, std::array{640, 40, 80}, std::array{1920, 120, 240},
          std::array{3840, 240, 480}, std::array{16384, 512, 512}}) {
        frame.display_width = width;
        EXPECT_EQ(motion_blur::tile_px({}, frame), tile);
        EXPECT_EQ(motion_blur::warp_settings({}, frame).shutter->max_path_px, path);
    }
}

TEST(Exact, SameBitsOnEveryRun) {
    const BlurFrame frame = random_frame(123, 77, 20, 1.5f, 43);
    for (const Values& values : many_settings()) {
        const ImageF first = blurred(blur(values), frame);
        for (int run = 0; run < 3; ++run)
            EXPECT_TRUE(equal_bits(blurred(blur(values), frame), first));
    }
}

}  // namespace
}  // namespace postchain::test
