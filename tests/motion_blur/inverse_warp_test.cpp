// mode: inverse_warp against closed forms, against ground truth accumulated over time samples, and
// against its reference.
#include <cmath>
#include <numbers>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

Chain warp(Values values = {}) {
    values.insert(values.begin(), {"mode", "inverse_warp"});
    return blur(values);
}
// Enough time samples that sampling is invisible.
Chain converged_warp() {
    return warp({{"samples", int64_t(401)}, {"path_px_per_time", 0.1}, {"noise", "none"}});
}

// Motion of both halves in pixels per frame; the shutter is open for half a frame.
void set_motion(BlurFrame& frame, int x, int y, double forward_x, double forward_y, double back_x,
                double back_y) {
    ImageF& back = frame.planes[Role::motion_back];
    if (back.empty()) back = ImageF(frame.width(), frame.height(), 2);
    float* f = frame.motion().pixel(x, y);
    float* b = back.pixel(x, y);
    f[0] = float(forward_x), f[1] = float(forward_y);
    b[0] = float(back_x), b[1] = float(back_y);
}

// A bar of `width` px at x0 at inverse depth 2, before black at 1.
BlurFrame bar(int picture, int x0, int width, double forward, double back) {
    BlurFrame frame(picture, 20);
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < picture; ++x) {
            const bool on = x >= x0 && x < x0 + width;
            set_motion(frame, x, y, on ? forward : 0, 0, on ? back : 0, 0);
            if (!on) continue;
            frame.set_gray(x, y, 1);
            frame.depth().at(x, y) = 2;
        }
    }
    return frame;
}

// Fraction of the open shutter during which the bar covers the center of pixel x; `at`: start of
// the bar at time t in frames.
template <class Position>
double coverage(int x, int width, Position at) {
    constexpr int kTimes = 4000;
    int covered = 0;
    for (int i = 0; i < kTimes; ++i) {
        const double begin = at((i + 0.5) / kTimes * 0.5 - 0.25);
        covered += x + 0.5 >= begin && x + 0.5 < begin + width;
    }
    return double(covered) / kTimes;
}

TEST(InverseWarp, OpacityOfAMovingBarIsExact) {
    for (const int width : {4, 13, 30}) {
        const BlurFrame frame = bar(120, 45, width, 48, 48);
        const ImageF out = blurred(converged_warp(), frame);
        for (int x = 20; x < 100; ++x) {
            const double expected = coverage(x, width, [](double t) { return 45 + 48 * t; });
            // Edges are accurate to half a pixel of a path of 24.
            EXPECT_NEAR(out.at(x, 10, 0), expected, 0.06) << "width " << width << ", x " << x;
        }
    }
}

// A shutter that opens at the frame, or closes at it, blurs to one side.
TEST(InverseWarp, TheShutterMayOpenOrCloseAtTheFrame) {
    const BlurFrame frame = bar(120, 45, 13, 48, 48);
    for (const auto& [position, opens] :
         {std::pair{ShutterPosition::start, 0.0}, {ShutterPosition::end, -0.5}}) {
        SCOPED_TRACE(shutter_position_names()[size_t(position)]);
        Chain chain = converged_warp();
        chain.camera.shutter_position = position;
        const ImageF out = blurred(chain, frame);
        for (int x = 10; x < 110; ++x) {
            const double expected = coverage(
                x, 13, [&, opens = opens](double t) { return 45 + 48 * (t + 0.25 + opens); });
            EXPECT_NEAR(out.at(x, 10, 0), expected, 0.06) << "x " << x;
        }
        Chain random = warp({{"samples", int64_t(15)}});
        random.camera.shutter_position = position;
        const BlurFrame noise = random_frame(67, 41, 9, 1.5f, 7);
        const Difference difference = compare(stages_of(random, noise).at("color"),
                                              reference_stages_of(random, noise).at("color"), 1e-3);
        EXPECT_LE(difference.fraction, 0.01) << difference.text;
    }
    Chain centered = blur({{"mode", "guertin"}});
    centered.camera.shutter_position = ShutterPosition::start;
    const auto plan = make_plan(centered, describe(frame.planes), {});
    ASSERT_FALSE(plan.ok());
    EXPECT_THAT(plan.status().message(),
                ::testing::HasSubstr("start is only supported by mode: inverse_warp"));
}

// A case where the 2013 filter fails: thin bars that move by many times their width.
// A bar five times as bright as the ground, whose halves of pixels at both ends have the ground's
// depth.
TEST(InverseWarp, ThinBarLeavesNoRimWhereItIsAtTheFrame) {
    BlurFrame frame = bar(120, 45, 4, 48, 48);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 120; ++x)
            frame.set_gray(x, y, x == 44 || x == 49 ? 0.3f : x >= 45 && x < 49 ? 0.5f : 0.1f);
    const ImageF out = blurred(converged_warp(), frame);
    for (int x = 25; x < 70; ++x) {
        const double covered = coverage(x, 5, [](double t) { return 44.5 + 48 * t; });
        EXPECT_NEAR(out.at(x, 10), 0.1 + 0.4 * covered, 0.02) << x;
    }
}

// Noise in stripes of two depths that move together by parts of pixels: their edges are
// interpolated like everything else.
TEST(InverseWarp, AnEdgeBetweenWhatMovesTogetherDoesNotShow) {
    const auto filtered = [](float depth, double half_velocity) {
        BlurFrame frame(96, 40);
        frame.color() = noise_image(96, 40, 4, 3);
        frame.set_all_half_velocities(half_velocity, 0.6);
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 96; ++x)
                if (x / 8 % 2 == 1) frame.depth().at(x, y) = depth;
        return blurred(converged_warp(), frame);
    };
    for (const double half_velocity : {0.3, 1.4, 6.3}) {
        const ImageF one = filtered(1, half_velocity), two = filtered(2, half_velocity);
        for (int x = 16; x < 80; ++x)
            EXPECT_NEAR(two.at(x, 20), one.at(x, 20), 1e-4) << half_velocity << ", " << x;
    }
}

// Adds the planes of a neighbor.
void add_neighbor(BlurFrame& frame, Neighbor neighbor, const BlurFrame& other) {
    for (const auto& [role, plane] : other.planes) frame.planes[role_of(neighbor, role)] = plane;
}

// Forward +40 px, backward -40: the bar was on the right before and is there again after, in steady
// motion. A straight path to each; a parabola would hardly leave the position.
TEST(InverseWarp, WhatBouncesStaysOnItsSide) {
    BlurFrame frame = bar(120, 45, 6, 40, -40);
    add_neighbor(frame, Neighbor::before, bar(120, 85, 6, -40, -40));
    add_neighbor(frame, Neighbor::after, bar(120, 85, 6, 40, 40));
    const ImageF out = blurred(converged_warp(), frame);
    for (int x = 20; x < 100; ++x) {
        const double expected = coverage(x, 6, [](double t) { return 45 + 40 * std::abs(t); });
        EXPECT_NEAR(out.at(x, 10, 0), expected, 0.08) << x;
    }
}

// A wall of waves at the position `of` at time t in frames, and its motion to the next and from the
// last frame.
template <class Position>
BlurFrame wall_at(double t, const Position& of) {
    BlurFrame frame(96, 20);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 96; ++x) {
            set_motion(frame, x, y, of(t + 1) - of(t), 0, of(t) - of(t - 1), 0);
            frame.set_gray(x, y, float(0.5 + 0.4 * std::sin(0.6 * (x - of(t)))));
        }
    return frame;
}

// RMS error of a frame against the mean over its shutter, away from the borders.
template <class Position>
double error_of_wall(const ImageF& out, const Position& of) {
    double sum = 0;
    for (int x = 24; x < 72; ++x) {
        double truth = 0;
        for (int i = 0; i < 400; ++i)
            truth += (0.5 + 0.4 * std::sin(0.6 * (x - of((i + 0.5) / 800 - 0.25)))) / 400;
        sum += std::pow(out.at(x, 10) - truth, 2) / 48;
    }
    return std::sqrt(sum);
}

// A pendulum of 40 px and twelve frames a period where it turns, and a ball that bounces at 20 px a
// frame under an acceleration of 2 px. Both have |b| > |a|; their neighbors tell them apart. A
// frame alone takes both for a turn.
TEST(InverseWarp, WhatTurnsIsToldFromWhatBounces) {
    const auto pendulum = [](double t) { return 40 * std::cos(std::numbers::pi / 6 * (t + 0.1)); };
    const auto ball = [](double t) { return 20 * std::abs(t) - t * t; };
    const auto error = [](const auto& of, const std::vector<Neighbor>& given) {
        BlurFrame frame = wall_at(0, of);
        for (const Neighbor neighbor : given)
            add_neighbor(frame, neighbor, wall_at(neighbor == Neighbor::before ? -1 : 1, of));
        return error_of_wall(blurred(converged_warp(), frame), of);
    };
    const double pendulum_still = error_of_wall(wall_at(0, pendulum).color(), pendulum);
    const double ball_still = error_of_wall(wall_at(0, ball).color(), ball);
    EXPECT_LT(error(pendulum, {}), 0.5 * pendulum_still);
    EXPECT_LT(error(ball, {}), 0.9 * ball_still);
    for (const auto& given : {std::vector{Neighbor::before}, std::vector{Neighbor::after},
                              std::vector{Neighbor::before, Neighbor::after}}) {
        EXPECT_LT(error(pendulum, given), 0.5 * pendulum_still);
        EXPECT_LT(error(ball, given), 0.1 * ball_still);
    }
}

// An image that rotates by half a radian per frame about its center.
struct Turning {
    static constexpr int kSize = 96;
    static constexpr double kTurn = 0.5;
    static double pattern(double x, double y) {
        return 0.5 + 0.25 * std::sin(0.21 * x) + 0.25 * std::cos(0.17 * y + 0.05 * x);
    }
    static std::array<double, 2> turned(double x, double y, double angle) {
        return {std::cos(angle) * x - std::sin(angle) * y,
                std::sin(angle) * x + std::cos(angle) * y};
    }
    static BlurFrame frame() {
        BlurFrame frame(kSize, kSize);
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const double px = x - 0.5 * kSize, py = y - 0.5 * kSize;
                const auto next = turned(px, py, kTurn), last = turned(px, py, -kTurn);
                set_motion(frame, x, y, next[0] - px, next[1] - py, px - last[0], py - last[1]);
                frame.set_gray(x, y, float(pattern(px, py)));
            }
        }
        return frame;
    }
    // Mean over the shutter, within a circle about the center that always stays inside the image.
    static double error(const ImageF& out) {
        double sum = 0;
        int count = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const double px = x - 0.5 * kSize, py = y - 0.5 * kSize;
                if (px * px + py * py > 40 * 40) continue;
                double truth = 0;
                for (int i = 0; i < 64; ++i) {
                    const double t = (i + 0.5) / 64 * 0.5 - 0.25;
                    const auto from = turned(px, py, -kTurn * t);
                    truth += pattern(from[0], from[1]) / 64;
                }
                sum += std::pow(out.at(x, y, 0) - truth, 2);
                ++count;
            }
        }
        return std::sqrt(sum / count);
    }
};

TEST(InverseWarp, PathThroughThreePositionsFollowsWhatTurns) {
    const BlurFrame both = Turning::frame();
    BlurFrame forward = both;
    forward.planes.erase(Role::motion_back);
    const double curved = Turning::error(blurred(converged_warp(), both));
    const double straight = Turning::error(blurred(converged_warp(), forward));
    EXPECT_LT(curved, 0.004);
    EXPECT_LT(3 * curved, straight);
}

TEST(InverseWarp, SlowFramesReturnEveryBitUnlessOneHalfIsFast) {
    BlurFrame frame = random_frame(60, 40, 0.3f, 1.5f, 5);
    frame.planes[Role::motion_back] = frame.motion();
    Plan plan;
    filter(warp(), describe(frame.planes), frame.planes, {}, &plan);
    EXPECT_TRUE(plan.passes[0].elided);
    EXPECT_TRUE(equal_bits(blurred(warp(), frame), frame.color()));
    for (float& v : frame.planes[Role::motion_back].data) v = 30;
    filter(warp(), describe(frame.planes), frame.planes, {}, &plan);
    EXPECT_FALSE(plan.passes[0].elided);
    EXPECT_FALSE(equal_bits(blurred(warp(), frame), frame.color()));
}

// Surfaces of many blocks reach each block.
TEST(InverseWarp, FindsWhatReachesABlockFromFarAway) {
    BlurFrame frame(2400, 3);
    frame.color() = noise_image(2400, 3, 4, 5);
    frame.set_all_half_velocities(-800, -3);
    for (int x = 0; x < 2400; ++x) {  // a row of objects, each with a speed of its own
        const int object = x / 200;
        frame.depth().at(x, 1) = float(5 + object);
        frame.set_half_velocity(x, 1, 800 - 100 * object, 3);
    }
    for (const int64_t starts : {3, 8}) {
        const Chain chain = warp({{"max_blur_px", int64_t(1000)}, {"starts", starts}});
        const Difference difference = compare(stages_of(chain, frame).at("color"),
                                              reference_stages_of(chain, frame).at("color"), 1e-3);
        EXPECT_LE(difference.fraction, 0.01) << starts << " starts: " << difference.text;
    }
}

// As many blocks as a line can have. llvmpipe ends loops after 65535 iterations.
TEST(InverseWarp, FindsWhatReachesABlockFromTheOtherEndOfALongLine) {
    const int length = 16384;
    BlurFrame frame(2, length);
    frame.color() = noise_image(2, length, 4, 5);
    for (int y = 0; y < length; ++y) {  // a column of objects, each with a speed of its own
        const int object = y / 1000;
        frame.depth().at(0, y) = 40;
        frame.depth().at(1, y) = float(5 + object);
        frame.set_half_velocity(0, y, 3, -8000);
        frame.set_half_velocity(1, y, 3, float(8000 - 900 * object));
    }
    const Chain chain =
        warp({{"max_blur_fraction", 1.0}, {"starts", int64_t(8)}, {"samples", int64_t(7)}});
    const Difference difference = compare(stages_of(chain, frame).at("color"),
                                          reference_stages_of(chain, frame).at("color"), 1e-3);
    EXPECT_LE(difference.fraction, 0.001) << difference.text;
}

}  // namespace
}  // namespace postchain::test
