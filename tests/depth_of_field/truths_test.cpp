// Properties of depth of field, one test each. "All in focus" is in elision_test.cpp, "s -> f", "d
// -> 0" and the depth encodings are in coc_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/depth_of_field/support.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
const std::string kLeaks[] = {"none", "depth", "coc"};

FramePlanes mirrored(const FramePlanes& planes) {
    FramePlanes result = planes;
    for (auto& [role, image] : result)
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x)
                for (int c = 0; c < image.channels; ++c)
                    image.at(x, y, c) = planes.at(role).at(image.width - 1 - x, y, c);
    return result;
}

TEST(truths, constant_color_returns_every_bit) {
    FramePlanes planes = deep_planes(37, 29);
    planes[Role::color] = constant_image(37, 29, {0.1f, 0.7f, 33.3f, 1});
    for (const char* coc : {"lens", "planes", "range"})
        for (const std::string& leak : kLeaks)
            for (const int factor : {1, 2, 4})
                for (const bool hdr : {false, true})
                    EXPECT_TRUE(equal_bits(dof(planes, {{"coc", std::string(coc)},
                                                        {"leak", leak},
                                                        {"downsample", int64_t(factor)},
                                                        {"hdr_weight", hdr}}),
                                           planes[Role::color]))
                        << coc << " leak " << leak << " by " << factor << " hdr " << hdr;
}

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
// sky with one |R| give the same bits; no leak test has an effect.
TEST(truths, all_sky_only_near_only_far) {
    const ImageF color = noise_image(37, 29, 4, 5);
    const ImageF sky = dof(flat_planes(color, 0), {});
    const ImageF near = dof(flat_planes(color, 0.5f), {});
    const ImageF far = dof(flat_planes(color, 0.125f), {});
    EXPECT_TRUE(equal_bits(sky, near));
    EXPECT_FALSE(equal_bits(sky, far));
    for (const float w : {0.0f, 0.5f, 0.125f}) {
        const FramePlanes planes = flat_planes(color, w);
        const ImageD expected = dof_reference(planes, {}).planes.at(Role::color);
        for (const std::string& leak : kLeaks) {
            const Difference difference = compare(dof(planes, {{"leak", leak}}), expected, 2e-5);
            EXPECT_LE(difference.max, 2e-5) << "w " << w << " leak " << leak << difference.text;
        }
    }
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

// W not a multiple of `downsample`: the last box has the remaining pixels. At 1/4 and 1/2 size, the
// right-most column of a 37 px wide image is column 36 by itself.
TEST(truths, width_not_a_multiple_of_the_box) {
    FramePlanes planes = flat_planes(constant_image(37, 8, {1, 1, 1, 1}), 0);
    for (int y = 0; y < 8; ++y) planes[Role::color].at(36, y, 0) = 5;
    for (const int factor : {2, 4}) {
        const Stages stages =
            dof_stages(planes, {{"downsample", int64_t(factor)}, {"blur_sigma_px", 0.0}});
        const ImageF& small = stages.stages.at(stage("small"));
        ASSERT_EQ(small.width, (37 + factor - 1) / factor);
        EXPECT_EQ(small.at(small.width - 1, 0), 5);
        EXPECT_EQ(small.at(small.width - 2, 0), 1);
    }
}

// NaN counts as 0, an infinity as the largest half of its sign: the result is that of an image that
// holds these.
TEST(truths, nan_and_infinity_count_as_the_largest_half) {
    FramePlanes planes = flat_planes(noise_image(37, 29, 4, 9), 0);
    for (int x = 20; x < 37; ++x)
        for (int y = 0; y < 29; ++y)
            planes[Role::inverse_depth].at(x, y) = 0.235f;  // R = 0.48, sharp
    planes[Role::color].at(5, 5, 0) = kNan;
    planes[Role::color].at(6, 5, 1) = kInfinity;
    planes[Role::color].at(30, 20, 2) = -kInfinity;
    for (int i = 0; i < 16; ++i) planes[Role::color].at(8 + i % 4, 8 + i / 4, 3) = kNan;  // a box
    FramePlanes finite = planes;
    for (float& value : finite[Role::color].data) {
        if (std::isnan(value)) value = 0;
        if (std::isinf(value)) value = std::copysign(65504.0f, value);
    }
    for (const std::string& leak : kLeaks)
        for (const bool hdr : {false, true}) {
            const Settings settings = {{"leak", leak}, {"hdr_weight", hdr}};
            const Stages stages = dof_stages(planes, settings);
            const ImageF& result = stages.outputs.at(Role::color);
            EXPECT_EQ(result.at(30, 20, 2), -65504.0f);
            EXPECT_TRUE(equal_bits(result, dof_stages(finite, settings).outputs.at(Role::color)));
            const ReferenceFrame expected = dof_reference(planes, settings);
            for (const char* name : {"small", "blur_x", "blur_y"}) {
                const Difference difference =
                    compare(stages.stages.at(stage(name)), expected.stages.at(stage(name)), 2e-5);
                EXPECT_LE(difference.max, 2e-5) << name << ": " << difference.text;
            }
        }
}

// hdr_weight suppresses fireflies: a box of 0.5 with one pixel of 1e10, which weighs 1e-10, is (15
// * 0.5/1.5 + 1)/(15/1.5 + 1e-10) = 0.6, wherever the firefly is in the box.
TEST(truths, firefly_under_hdr_weight) {
    for (int i = 0; i < 16; ++i) {
        FramePlanes planes = flat_planes(constant_image(4, 4, {0.5f, 0.5f, 0.5f, 1}), 0);
        planes[Role::color].at(i % 4, i / 4, 0) = 1e10f;
        const Stages stages = dof_stages(planes, {{"hdr_weight", true}});
        EXPECT_NEAR(stages.stages.at(stage("small")).at(0, 0), 0.6, 1e-6) << i;
    }
}

TEST(truths, result_stays_inside_the_range_of_its_inputs) {
    FramePlanes planes = deep_planes(53, 35);
    planes[Role::color] = noise_image(53, 35, 4, 11, -7, -2);
    for (const std::string& leak : kLeaks)
        for (const bool hdr : {false, true})
            for (const float value : dof(planes, {{"leak", leak}, {"hdr_weight", hdr}}).data) {
                ASSERT_GE(value, -7 - 1e-5f);
                ASSERT_LE(value, -2 + 1e-5f);
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

TEST(truths, mirrored_input_gives_mirrored_output) {
    const FramePlanes planes = deep_planes(40, 32);  // whole boxes
    for (const std::string& leak : kLeaks) {
        const Settings settings = {{"leak", leak}};
        FramePlanes result;
        result[Role::color] = dof(planes, settings);
        const ImageF twice = mirrored(result).at(Role::color);
        const Difference difference = compare(dof(mirrored(planes), settings), twice, 2e-6);
        EXPECT_LE(difference.max, 2e-6) << leak << ": " << difference.text;
    }
}

TEST(truths, same_bits_on_every_run) {
    const FramePlanes planes = deep_planes(53, 35);
    EXPECT_TRUE(equal_bits(dof(planes, {{"leak", "coc"s}}), dof(planes, {{"leak", "coc"s}})));
}

TEST(truths, hint_exists_only_where_somebody_reads_it) {
    FramePlanes planes = deep_planes(20, 16);
    planes[Role::hint] = constant_image(20, 16, {1, 1});
    const FrameDescription frame = describe_round(planes);
    const auto unread = make_plan(chain_of("depth_of_field", {{"method", "gilham"}}), frame);
    ASSERT_TRUE(unread.ok());
    for (const PlanTexture& texture : unread->textures) EXPECT_NE(texture.name, stage("hint"));
    PlanOptions options{.outputs = {Role::color, Role::hint}};
    const Stages stages = filter_with_stages(chain_of("depth_of_field", {{"method", "gilham"}}),
                                             frame, planes, options);
    const ReferenceFrame expected =
        reference(chain_of("depth_of_field", {{"method", "gilham"}}), frame, planes, options);
    ASSERT_TRUE(stages.outputs.count(Role::hint));
    const Difference difference =
        compare(stages.outputs.at(Role::hint), expected.planes.at(Role::hint), 1e-5);
    EXPECT_LE(difference.max, 1e-5) << difference.text;
}

}  // namespace
}  // namespace postchain::test
