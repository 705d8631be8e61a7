// The layer behind (chain/frame/behind.h), in the three passes that use the inverse warp. (What a
// moving post hides: edges_test.cpp.)
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "chain/frame/behind.h"
#include "chain/frame/layers.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain::test::second_layer_test {
namespace {

constexpr int kWidth = 144, kHeight = 24;

Chain motion_blur() {
    return chain_of("motion_blur", {{"mode", "inverse_warp"}, {"path_px_per_time", 0.25}});
}

Chain depth_of_field() {
    return chain_of("depth_of_field",
                    {{"method", "inverse_warp"}, {"samples", int64_t(512)}, {"denoise", false}});
}

struct Surface {
    double gray, inverse_depth, speed;
};

FramePlanes planes_of(const std::function<Surface(double x)>& at) {
    FramePlanes planes;
    planes[Role::color] = ImageF(kWidth, kHeight, 4, 1);
    planes[Role::inverse_depth] = ImageF(kWidth, kHeight, 1);
    planes[Role::motion] = ImageF(kWidth, kHeight, 2);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const Surface surface = at(x);
            for (int c = 0; c < 3; ++c) planes[Role::color].at(x, y, c) = float(surface.gray);
            planes[Role::inverse_depth].at(x, y) = float(surface.inverse_depth);
            planes[Role::motion].at(x, y, 0) = float(surface.speed);
        }
    return planes;
}

ImageF filtered(const Chain& chain, const FramePlanes& planes) {
    return filter(chain, describe_round(planes), planes).at(Role::color);
}

double pattern(double x) {
    return 0.5 + 0.3 * std::sin(0.35 * x) + 0.15 * std::sin(1.3 * x);
}

// A bar that moves before a ground at rest, and between them a board at rest that the bar hides
// whole.
constexpr double kBar = 50, kBarEnd = 90, kSpeed = 48;  // px, px, px per frame
Surface ground_at(double x) {
    return {pattern(x), 0.2, 0};
}
Surface board_at(double x) {
    if (x < kBar + 2 || x >= kBarEnd - 2) return ground_at(x);
    return {1.5 + 0.4 * std::sin(0.9 * x), 0.25, 0};
}
Surface bar_at(double x) {
    return x >= kBar && x < kBarEnd ? Surface{3, 0.5, kSpeed} : ground_at(x);
}

FramePlanes moving_bar() {
    FramePlanes planes = planes_of(bar_at);
    planes[Role::behind] = stack_behind(planes_of(board_at));
    return planes;
}

// A half plane out of focus before a pattern in focus: the share of the lens that sees past it.
TEST(SecondLayer, ShowsWhatABlurredEdgeHides) {
    constexpr double kEdge = 64, kRadius = 16;  // px
    const auto sharp = [](double x) { return Surface{pattern(x), 0.25, 0}; };
    FramePlanes planes = planes_of([&](double x) {
        return x < kEdge ? Surface{2, 0.75, 0} : sharp(x);
    });
    const auto truth = [&](int x) {
        const double d = std::clamp((x + 0.5 - kEdge) / kRadius, -1.0, 1.0);
        const double past = 0.5 + (d * std::sqrt(1 - d * d) + std::asin(d)) / std::acos(-1.0);
        return past * pattern(x) + (1 - past) * 2;
    };
    // RMS error of the middle row.
    const auto error = [&] {
        const ImageF out = filtered(depth_of_field(), planes);
        double sum = 0;
        for (int x = 40; x < kEdge; ++x) sum += std::pow(out.at(x, kHeight / 2) - truth(x), 2);
        return std::sqrt(sum / (kEdge - 40));
    };
    const double without = error();
    planes[Role::behind] = stack_behind(planes_of(sharp));
    const double with = error();
    EXPECT_LT(with, 0.03);
    EXPECT_LT(with, 0.25 * without);
}

// A ground that moves in from beyond the border, with a sky behind all of it.
TEST(SecondLayer, FillsNothingFromBehindWhatComesFromBeyondTheBorder) {
    FramePlanes planes = planes_of([](double x) { return Surface{pattern(x), 0.2, 40}; });
    for (const auto& [role, plane] : planes_of([](double x) {
             return Surface{pattern(x + 40), 0.2, 40};
         }))
        planes[role_of(Neighbor::after, role)] = plane;
    const ImageF without = filtered(motion_blur(), planes);
    planes[Role::behind] = stack_behind(planes_of([](double) { return Surface{9, 0, 0}; }));
    const ImageF with = filtered(motion_blur(), planes);
    EXPECT_TRUE(equal_bits(with, without));
}

// Shares of the fill mask's channels over the image: this frame, another one, an estimate.
std::array<double, 3> shares_of(const Chain& chain, FramePlanes planes) {
    const ImageF mask = constant_image(kWidth, kHeight, {1, 0, 0, 0});
    planes[Role::layers] = mask;
    if (planes.contains(Role::behind))
        planes[Role::behind] = stack_planes({planes.at(Role::behind), mask});
    FrameDescription frame = describe_round(planes);
    frame.fill_layer = 0;
    const ImageF out = filter(chain, frame, planes).at(Role::layers);
    std::array<double, 3> shares = {};
    for (size_t i = 0; i < out.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c)
            shares[c] += double(out.data[4 * i + c]) / double(out.pixels());
    return shares;
}

TEST(SecondLayer, TakesThePlaceOfEstimatesInTheFillMask) {
    FramePlanes planes = moving_bar();
    const auto with = shares_of(motion_blur(), planes);
    planes.erase(Role::behind);
    const auto without = shares_of(motion_blur(), planes);
    EXPECT_GT(without[2], 0.02);
    EXPECT_EQ(without[1], 0);
    EXPECT_LT(with[2], 0.05 * without[2]);
    EXPECT_NEAR(with[1], without[2], 0.1 * without[2]);
}

bool uses_it(const Plan& plan) {
    return std::any_of(plan.steps.begin(), plan.steps.end(), [](const Step& step) {
        return step.name == "second_surfaces" || step.program.defines.contains("SECOND_LAYER");
    });
}

TEST(SecondLayer, IsPlannedOnlyForAPassWhoseColorIsTheFrames) {
    const FramePlanes planes = moving_bar();
    FrameDescription frame = describe_round(planes);
    FrameDescription without = frame;
    without.planes.remove(Role::behind);
    for (const Chain& chain : {motion_blur(), depth_of_field(), chain_of("joint_blur")}) {
        EXPECT_TRUE(uses_it(*make_plan(chain, frame, {.elide = false})));
        EXPECT_FALSE(uses_it(*make_plan(chain, without, {.elide = false})));
    }
    Chain two = motion_blur();
    append(two, "depth_of_field", {{"method", "inverse_warp"}});
    const auto plan = make_plan(two, frame, {.elide = false});
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    for (const Step& step : plan->steps)
        EXPECT_TRUE(step.pass == 0 || !step.program.defines.contains("SECOND_LAYER")) << step.name;
}

}  // namespace
}  // namespace postchain::test::second_layer_test
