// Properties of `gilham`, one test each. "s -> f", "d -> 0" and the depth encodings are in
// coc_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/depth_of_field/support.h"

namespace postchain::test {
namespace {

const std::string kLeaks[] = {"none", "depth", "coc"};

TEST(truths, in_focus_pixels_return_every_bit_beside_blurred_ones) {
    FramePlanes planes = deep_planes(37, 29);
    const Stages stages = dof_stages(planes, {});
    const ImageF& coc = stages.stages.at(stage("coc"));
    int sharp = 0, changed = 0;
    for (int y = 0; y < 29; ++y)
        for (int x = 0; x < 37; ++x) {
            const bool same =
                std::equal(planes[Role::color].pixel(x, y), planes[Role::color].pixel(x, y) + 4,
                           stages.outputs.at(Role::color).pixel(x, y));
            if (std::abs(coc.at(x, y)) <= 0.5f) {
                ++sharp;
                EXPECT_TRUE(same) << x << "," << y;
            } else {
                changed += !same;
            }
        }
    EXPECT_GT(sharp, 50);
    EXPECT_GT(changed, 500);
}

// All sky, all near, all far: R = 8, -8 and 4 everywhere. The filter ignores the sign, so near and
// sky with one |R| give the same bits.
TEST(truths, all_sky_only_near_only_far) {
    const ImageF color = noise_image(37, 29, 4, 5);
    const ImageF sky = dof(flat_planes(color, 0), {});
    EXPECT_TRUE(equal_bits(sky, dof(flat_planes(color, 0.5f), {})));
    EXPECT_FALSE(equal_bits(sky, dof(flat_planes(color, 0.125f), {})));
}

TEST(truths, one_pixel_and_less_than_a_box) {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 3}, {3, 1}}) {
        const ImageF color = noise_image(width, height, 4, 7);
        for (const std::string& leak : kLeaks) {
            const ImageF result = dof(flat_planes(color, 0), {{"leak", leak}});
            EXPECT_EQ(result.width, width);
            // A single box is constant: sum and mean stay.
            EXPECT_NEAR(sum_of(result), sum_of(color), 1e-5) << width << "x" << height;
            EXPECT_EQ(equal_bits(result, color), width * height == 1);
        }
    }
}

// A dot of one pixel, its kernel inside the image, one |R| everywhere: box mean, Gaussian and
// bilinear up-sampling each keep the sum (the up-sampling's weights of one texel add to
// downsample^2). Bound: 1e-5 of the dot's energy, whatever the leak test.
TEST(truths, energy_of_a_dot) {
    for (const int factor : {1, 2, 4})
        for (const std::string& leak : kLeaks)
            for (const auto& [x, y] : {std::pair{30, 31}, {31, 32}, {33, 29}}) {
                ImageF color(64, 64, 4);
                color.at(x, y, 0) = 100;
                const ImageF result =
                    dof(flat_planes(color, 0),
                        {{"blur_sigma_px", 3.0}, {"downsample", int64_t(factor)}, {"leak", leak}});
                EXPECT_NEAR(sum_of(result), 100, 1e-3) << factor << " leak " << leak;
                EXPECT_LT(result.at(x, y), 10);
            }
}

// At the border the kernel's in-bounds part is renormalized. A dot at x keeps the sum over p of
// g(p - x) / (sum of g over the pixels around p): for sigma = 3, cut at 9, between 0.7674 (x = 0)
// and 1.0719 (a few pixels inside), from the formula evaluated by itself.
TEST(truths, energy_of_a_dot_at_the_border) {
    double lowest = 1, highest = 1;
    for (int x = 0; x < 20; ++x) {
        ImageF color(64, 64, 4);
        color.at(x, 32, 0) = 100;
        const double kept = sum_of(dof(flat_planes(color, 0),
                                       {{"blur_sigma_px", 3.0}, {"downsample", int64_t(1)}})) /
                            100;
        lowest = std::min(lowest, kept);
        highest = std::max(highest, kept);
    }
    EXPECT_NEAR(lowest, 0.7674, 1e-4);
    EXPECT_NEAR(highest, 1.0719, 1e-4);
}

}  // namespace
}  // namespace postchain::test
