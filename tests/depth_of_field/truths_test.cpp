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

}  // namespace
}  // namespace postchain::test
