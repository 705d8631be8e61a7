// Pixels that are not square: a disc is round on the display.
#include <gtest/gtest.h>

#include <cmath>

#include "passes/common/circle_of_confusion.h"
#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

FramePlanes dot_planes(float inverse_depth) {
    ImageF color = constant_image(101, 101, {0, 0, 0, 1});
    color.at(50, 50) = 1;
    return flat_planes(std::move(color), inverse_depth);
}

FrameDescription described(const FramePlanes& planes, double aspect) {
    FrameDescription frame = describe_round(planes);
    frame.pixel_aspect = aspect;
    return frame;
}

// R along x is that of square pixels, 32 (w - 1/4) px: the sensor spans the display's width. Along
// y it is R times the aspect: a pixel is that much wider than high. An even ellipse with these
// half-axes has the variances Rx^2/4 and Ry^2/4.
TEST(PixelAspect, DiscIsRoundOnTheDisplay) {
    const FramePlanes planes = dot_planes(0.625f);  // 12 px
    const Chain chain =
        chain_of("depth_of_field",
                 {{"method", "inverse_warp"}, {"samples", int64_t(1023)}, {"noise", "none"}});
    for (const double aspect : {1.0, 2.0, 0.5}) {
        const ImageF out =
            filter(chain, described(planes, aspect), planes, {.elide = false}).at(Role::color);
        const double rx = 12, ry = 12 * aspect;
        const Moments s = moments_of(out, 50, 50);
        EXPECT_NEAR(s.light, 1, 0.03) << aspect;
        EXPECT_NEAR(s.xx, rx * rx / 4, 0.03 * rx * rx / 4) << aspect;
        EXPECT_NEAR(s.yy, ry * ry / 4, 0.03 * ry * ry / 4) << aspect;
        // Nothing lies beyond the ellipse, apart from denoising.
        for (int y = 0; y < 101; ++y)
            for (int x = 0; x < 101; ++x)
                if (std::hypot((x - 50) / (rx + 3), (y - 50) / (ry + 3)) > 1) {
                    ASSERT_LE(out.at(x, y), 1e-6) << aspect << ": " << x << ", " << y;
                }
    }
}

// The Gaussian of `gilham`, 8 px in shorter sides of a pixel: its variances along x and y.
TEST(PixelAspect, GaussianIsRoundOnTheDisplay) {
    const FramePlanes planes = dot_planes(1);
    const Chain chain = chain_of("depth_of_field", {{"method", "gilham"},
                                                    {"downsample", int64_t(1)},
                                                    {"blur_sigma_px", 8.0},
                                                    {"leak", "none"}});
    for (const double aspect : {1.0, 2.0, 0.5}) {
        const ImageF out =
            filter(chain, described(planes, aspect), planes, {.elide = false}).at(Role::color);
        const double sx = 8 * std::min(1 / aspect, 1.0), sy = 8 * std::min(aspect, 1.0);
        // Cut at three deviations a Gaussian keeps 0.973 of its variance.
        const Moments s = moments_of(out, 50, 50);
        EXPECT_NEAR(s.light, 1, 1e-5) << aspect;
        EXPECT_NEAR(s.xx, 0.973 * sx * sx, 0.04 * sx * sx) << aspect;
        EXPECT_NEAR(s.yy, 0.973 * sy * sy, 0.04 * sy * sy) << aspect;
    }
}

// A frame reaches as far, and is elided, by the longer half-axis.
TEST(PixelAspect, BoundsAreOfTheLongerHalfAxis) {
    FrameDescription frame = described(dot_planes(0.75f), 2);
    frame.bounds.min_inverse_depth = frame.bounds.max_inverse_depth = 0.25 + 0.4 / 32;
    const Chain chain = chain_of("depth_of_field", {{"method", "inverse_warp"}});
    EXPECT_FALSE(must(make_plan(chain, frame)).passes[0].elided)
        << "0.4 px along x, but 0.8 px along y";
    frame.pixel_aspect = 1;
    EXPECT_TRUE(must(make_plan(chain, frame)).passes[0].elided);
}

// The limit of radii: an eighth of the display's width. What exceeds it is known, unclamped.
TEST(MaxRadius, FollowsTheWidthAndIsKnown) {
    FrameDescription frame = described(dot_planes(0.75f), 1);  // R = 32 (1/4 - w) px
    frame.bounds.min_inverse_depth = 0;
    frame.bounds.max_inverse_depth = 4.25;  // R = -128 px
    lens::CircleOfConfusion coc = *lens::circle_of_confusion({}, frame);
    EXPECT_EQ(coc.max_radius_px, 80);
    ASSERT_EQ(lens::exceeded_limits(coc, frame).size(), 1u);
    const ExceededLimit exceeded = lens::exceeded_limits(coc, frame)[0];
    EXPECT_EQ(exceeded.limit_px, 80);
    EXPECT_NEAR(exceeded.largest_px, 128, 1e-9);
    EXPECT_NEAR(exceeded.high, 2.75, 1e-9);  // 32 (2.75 - 1/4) = 80
    EXPECT_EQ(exceeded.low, 0);
    for (const UsedValue& value : lens::used_values({}, coc, frame, 0.5))
        if (value.key == "largest_circle_px") {
            EXPECT_NEAR(std::get<double>(value.value), 256, 1e-9);
        }
    frame.bounds.max_inverse_depth = 2.75;
    EXPECT_TRUE(lens::exceeded_limits(coc, frame).empty());
    // At 4 K the same camera is clamped at the same depth.
    frame.display_width = 3840;
    coc = *lens::circle_of_confusion({}, frame);
    EXPECT_EQ(coc.max_radius_px, 480);
    EXPECT_TRUE(lens::exceeded_limits(coc, frame).empty());
}

// As a fraction of the display's height, in shorter sides of a pixel.
TEST(MaxRadius, AsAFractionOfTheHeight) {
    lens::Parameters parameters;
    parameters.max_radius_fraction = 0.05;
    FrameDescription frame = described(dot_planes(0.75f), 1);
    frame.bounds.min_inverse_depth = 0;
    frame.bounds.max_inverse_depth = 4.25;  // R = -128 px at a width of 640
    for (const auto& [height, aspect, limit] :
         {std::tuple{360, 1.0, 18.0}, {2160, 1.0, 108.0}, {360, 2.0, 18.0}, {360, 0.5, 36.0}}) {
        frame.display_height = height;
        frame.pixel_aspect = aspect;
        const auto coc = *lens::circle_of_confusion(parameters, frame);
        EXPECT_DOUBLE_EQ(coc.max_radius_px, limit) << height << ", " << aspect;
        ASSERT_EQ(lens::exceeded_limits(coc, frame).size(), 1u);
        EXPECT_EQ(lens::exceeded_limits(coc, frame)[0].parameter, "max_radius_fraction");
    }
}

}  // namespace
}  // namespace postchain::test
