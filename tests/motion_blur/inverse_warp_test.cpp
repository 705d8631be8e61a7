// mode: inverse_warp against closed forms, against ground truth accumulated over time samples, and
// against its reference.
#include <cmath>
#include <numbers>

#include "tests/motion_blur/support.h"
#include "tests/support/status.h"

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

// Motion along x of both halves in pixels per frame; the shutter is open for half a frame.
void set_motion(BlurFrame& frame, int x, int y, double forward, double back) {
    ImageF& plane = frame.planes[Role::motion_back];
    if (plane.empty()) plane = ImageF(frame.width(), frame.height(), 2);
    plane.at(x, y) = float(back);
    frame.motion().at(x, y) = float(forward);
}

// A bar of `width` px at x0 at inverse depth 2, before black at 1.
BlurFrame bar(int x0, int width, double motion) {
    BlurFrame frame(120, 20);
    for (int y = 0; y < 20; ++y)
        for (int x = x0; x < x0 + width; ++x) {
            set_motion(frame, x, y, motion, motion);
            frame.set_gray(x, y, 1);
            frame.depth().at(x, y) = 2;
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

// At every position of the shutter: one that opens at the frame, or closes at it, blurs to one
// side.
TEST(InverseWarp, OpacityOfAMovingBarIsExact) {
    struct Case {
        ShutterPosition position;
        double opens;
        int width;
    };
    for (const auto& [position, opens, width] : {Case{ShutterPosition::center, -0.25, 4},
                                                 {ShutterPosition::center, -0.25, 13},
                                                 {ShutterPosition::center, -0.25, 30},
                                                 {ShutterPosition::start, 0, 13},
                                                 {ShutterPosition::end, -0.5, 13}}) {
        SCOPED_TRACE(concat(shutter_position_names()[size_t(position)], ", width ", width));
        Chain chain = converged_warp();
        chain.camera.shutter_position = position;
        const ImageF out = blurred(chain, bar(45, width, 48));
        for (int x = 10; x < 110; ++x) {
            const double expected = coverage(
                x, width, [&, opens = opens](double t) { return 45 + 48 * (t + 0.25 + opens); });
            // Edges are accurate to half a pixel of a path of 24.
            EXPECT_NEAR(out.at(x, 10, 0), expected, 0.06) << "x " << x;
        }
        Chain random = warp({{"samples", int64_t(15)}});
        random.camera.shutter_position = position;
        expect_reference(random, random_frame(67, 41, 9, 1.5f, 7), 0.01);
    }
    Chain guertin = blur();
    guertin.camera.shutter_position = ShutterPosition::start;
    EXPECT_THAT(error_of(make_plan(guertin, describe(bar(45, 13, 48).planes))),
                ::testing::HasSubstr("start is only supported by mode: inverse_warp"));
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

constexpr int kWallRows = 36;

// A wall of waves at the position `of` at time t in frames, and its motion to the next and from the
// last frame. Along y, where it has one color, it moves by `across`(t).
template <class Position, class Across>
BlurFrame wall_at(double t, const Position& of, const Across& across) {
    BlurFrame frame(96, kWallRows);
    for (int y = 0; y < kWallRows; ++y)
        for (int x = 0; x < 96; ++x) {
            set_motion(frame, x, y, of(t + 1) - of(t), of(t) - of(t - 1));
            frame.motion().at(x, y, 1) = float(across(t + 1) - across(t));
            frame.planes[Role::motion_back].at(x, y, 1) = float(across(t) - across(t - 1));
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
        sum += std::pow(out.at(x, kWallRows / 2) - truth, 2) / 48;
    }
    return std::sqrt(sum);
}

// A pendulum of 40 px and twelve frames a period where it turns; a ball that bounces at 10 px a
// frame under an acceleration of 2 px, also while it moves sideways or spins; and one whose keys
// are at every frame. Their neighbors tell them apart, also where their pixel shows something else.
// A frame alone takes all for a turn.
TEST(InverseWarp, WhatTurnsIsToldFromWhatBounces) {
    const auto still = [](double) { return 0.0; };
    const auto pendulum = [](double t) { return 40 * std::cos(std::numbers::pi / 6 * (t + 0.1)); };
    const auto ball = [](double t) { return 10 * std::abs(t) - t * t; };
    const auto sideways = [](double t) { return 13.5 * t; };
    const auto spin = [](double t) { return 4 * t * t; };
    const auto keys = [](double t) {
        const double in_period = std::abs(t - 2 * std::floor(t / 2 + 0.5));
        return 10 * in_period;
    };
    const auto error = [](const auto& of, const auto& across, const std::vector<Neighbor>& given,
                          int still_columns = 1000) {
        BlurFrame frame = wall_at(0, of, across);
        for (const Neighbor neighbor : given) {
            BlurFrame there = wall_at(neighbor == Neighbor::before ? -1 : 1, of, across);
            for (int y = 0; y < kWallRows; ++y)
                for (int x = 1; x < 96; x += still_columns) set_motion(there, x, y, 0, 0);
            for (const auto& [role, plane] : there.planes)
                frame.planes[role_of(neighbor, role)] = plane;
        }
        const Chain many = warp({{"samples", int64_t(101)}, {"noise", "none"}});
        return error_of_wall(blurred(many, frame), of);
    };
    const double pendulum_still = error_of_wall(wall_at(0, pendulum, still).color(), pendulum);
    const double ball_still = error_of_wall(wall_at(0, ball, still).color(), ball);
    EXPECT_LT(error(pendulum, still, {}), 0.5 * pendulum_still);
    EXPECT_GT(error(ball, still, {}), 0.5 * ball_still);
    for (const auto& given : {std::vector{Neighbor::before}, std::vector{Neighbor::after},
                              std::vector{Neighbor::before, Neighbor::after}}) {
        EXPECT_LT(error(pendulum, still, given), 0.5 * pendulum_still);
        EXPECT_LT(error(ball, still, given), 0.1 * ball_still);
        EXPECT_LT(error(ball, still, given, 3), 0.1 * ball_still);
        EXPECT_LT(error(ball, sideways, given), 0.1 * ball_still);
        EXPECT_LT(error(ball, spin, given), 0.1 * ball_still);
        EXPECT_LT(error(keys, still, given), 0.1 * ball_still);
        // Their neighbors show something else everywhere: the bend of the path alone decides.
        EXPECT_LT(error(ball, still, given, 1), 0.1 * ball_still);
        EXPECT_GT(error(ball, sideways, given, 1), 0.5 * ball_still);
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
                set_motion(frame, x, y, next[0] - px, px - last[0]);
                frame.motion().at(x, y, 1) = float(next[1] - py);
                frame.planes[Role::motion_back].at(x, y, 1) = float(py - last[1]);
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

// Streaks are half as long before and after the frame, or whole on one side of it.
TEST(InverseWarp, IsLeftOutIfItsLongestStreakIsShort) {
    const struct {
        ShutterPosition position;
        double forward, back;  // px per frame
        bool left_out;
    } cases[] = {
        {ShutterPosition::center, 1.9, 1.9, true},  {ShutterPosition::center, 2.1, 1.9, false},
        {ShutterPosition::center, 1.9, 2.1, false}, {ShutterPosition::start, 0.9, 0.9, true},
        {ShutterPosition::start, 1.1, 1.1, false},  {ShutterPosition::end, 0.9, 0.9, true},
        {ShutterPosition::end, 1.1, 1.1, false},
    };
    for (const auto& [position, forward, back, left_out] : cases) {
        BlurFrame frame(20, 10);
        set_motion(frame, 9, 5, forward, back);
        frame.color() = noise_image(20, 10, 4, 3);
        FrameDescription description = describe(frame.planes);
        description.camera.shutter_position = position;
        EXPECT_EQ(must(make_plan(warp(), description)).passes[0].elided, left_out)
            << shutter_position_names()[size_t(position)] << " " << forward << " " << back;
    }
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
        SCOPED_TRACE(starts);
        expect_reference(chain, frame, 0.01);
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
    expect_reference(chain, frame, 0.001);
}

}  // namespace
}  // namespace postchain::test
