// Pixels of every stage computed by hand. (The coc stage's are in coc_test.cpp.)
#include <gtest/gtest.h>

#include <cmath>

#include "tests/depth_of_field/support.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

constexpr double kBound = 1e-6;

// sigma with exp(-1/(2 sigma^2)) = 1/2: the taps weigh 1, 1/2, 1/16 (2^-4), 1/512 (2^-9), and
// ceil(3 * 0.849) = 3 ends the kernel there.
const double kHalvingSigma = std::sqrt(1 / (2 * std::log(2.0)));

// One row; the color is (value, 0, 0, 1).
ImageF row(const std::vector<float>& values) {
    ImageF image(int(values.size()), 1, 4);
    for (int x = 0; x < image.width; ++x) {
        image.at(x, 0, 0) = values[size_t(x)];
        image.at(x, 0, 3) = 1;
    }
    return image;
}

void expect_row(const ImageF& image, const std::vector<double>& expected) {
    ASSERT_EQ(image.width, int(expected.size()));
    for (int x = 0; x < image.width; ++x)
        EXPECT_NEAR(image.at(x, 0), expected[size_t(x)], kBound) << "pixel " << x;
}

// ------------------------------------------------------------------------------- downsample

// 5 x 3 pixels of value x + 10 y, boxes of 2 x 2 from the top left: 3 x 2 boxes.
// (0,0): (0+1+10+11)/4 = 5.5     (1,0): (2+3+12+13)/4 = 7.5    (2,0): column 4 only, (4+14)/2 = 9
// (0,1): row 2 only, (20+21)/2  (1,1): (22+23)/2 = 22.5       (2,1): pixel (4,2) only = 24
TEST(downsample_stage, boxes_by_hand) {
    ImageF color(5, 3, 4);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 5; ++x) color.at(x, y, 0) = float(x + 10 * y);
    const ImageF small =
        dof_stages(flat_planes(color, 0), {{"downsample", int64_t(2)}}).stages.at(stage("small"));
    ASSERT_EQ(small.width, 3);
    ASSERT_EQ(small.height, 2);
    EXPECT_NEAR(small.at(0, 0), 5.5, kBound);
    EXPECT_NEAR(small.at(1, 0), 7.5, kBound);
    EXPECT_NEAR(small.at(2, 0), 9, kBound);
    EXPECT_NEAR(small.at(0, 1), 20.5, kBound * 20);
    EXPECT_NEAR(small.at(1, 1), 22.5, kBound * 20);
    EXPECT_EQ(small.at(2, 1), 24);
    // 4 x 4: (0,0) is the mean of x 0..3 (1.5) and y 0..2 (1): 11.5; (1,0) is column 4: 14.
    const ImageF by_four = dof_stages(flat_planes(color, 0), {}).stages.at(stage("small"));
    ASSERT_EQ(by_four.width, 2);
    ASSERT_EQ(by_four.height, 1);
    EXPECT_NEAR(by_four.at(0, 0), 11.5, kBound * 20);
    EXPECT_NEAR(by_four.at(1, 0), 14, kBound * 20);
}

// Weights 1/(1 + max(rgb, 0)).
// {0, 3}: (0*1 + 3/4)/(1 + 1/4) = 0.6          {1, 1}: 1
// {-2, 2}: -2 weighs 1, 2 weighs 1/3: (-2 + 2/3)/(4/3) = -1
// {99, 0}: (99/100)/(1 + 1/100) = 99/101       {0, 0}: 0
TEST(downsample_stage, hdr_weight_by_hand) {
    const FramePlanes planes = flat_planes(row({0, 3, 1, 1, -2, 2, 99, 0, 0, 0}), 0);
    expect_row(dof_stages(planes, {{"downsample", int64_t(2)}, {"hdr_weight", true}})
                   .stages.at(stage("small")),
               {0.6, 1, -1, 99.0 / 101, 0});
    expect_row(dof_stages(planes, {{"downsample", int64_t(2)}}).stages.at(stage("small")),
               {1.5, 1, 0, 49.5, 0});
}

// Guides are plain means, of w and of |R|, R = 32 (1/4 - w).
// w {0, 1/4}: 1/8; |R| 8, 0: 4                 w {1/8, 1/2}: 5/16; |R| 4, 8: 6
// w {0, 1/2}: 1/4; |R| 8, 8: 8 (R would cancel) w {1/4, 1/4}: 1/4; 0
// w {3/4} only: 3/4; |R| 16
TEST(downsample_stage, guides_by_hand) {
    FramePlanes planes = flat_planes(row({1, 1, 1, 1, 1, 1, 1, 1, 1}), 0);
    planes[Role::inverse_depth].data = {0, 0.25f, 0.125f, 0.5f, 0, 0.5f, 0.25f, 0.25f, 0.75f};
    expect_row(dof_stages(planes, {{"downsample", int64_t(2)}, {"leak", "depth"s}})
                   .stages.at(stage("small_depth")),
               {0.125, 0.3125, 0.25, 0.25, 0.75});
    expect_row(dof_stages(planes, {{"downsample", int64_t(2)}, {"leak", "coc"s}})
                   .stages.at(stage("small_radius")),
               {4, 6, 8, 0, 16});
}

// -------------------------------------------------------------------------------------- blur

// A dot at pixel 3 of 7. Interior: total 1 + 2 (1/2 + 1/16 + 1/512) = 1090/512.
// pixel 3: all seven taps in bounds: 512/1090
// pixel 2: the tap at -1 is out: total 1089/512; the dot is one away: (1/2)/(1089/512) = 256/1089
// pixel 1: taps -1, -2 out (1/512, 1/16): total 1057/512; dot two away: 32/1057
// pixel 0: one side only: total 1 + 1/2 + 1/16 + 1/512 = 801/512; dot three away: 1/801
TEST(blur_stages, dot_by_hand) {
    const Settings settings = {{"downsample", int64_t(1)}, {"blur_sigma_px", kHalvingSigma}};
    const std::vector<double> expected = {1.0 / 801,    32.0 / 1057, 256.0 / 1089, 512.0 / 1090,
                                          256.0 / 1089, 32.0 / 1057, 1.0 / 801};
    const FramePlanes planes = flat_planes(row({0, 0, 0, 1, 0, 0, 0}), 0);
    const Stages stages = dof_stages(planes, settings);
    expect_row(stages.stages.at(stage("blur_x")), expected);
    expect_row(stages.stages.at(stage("blur_y")), expected);  // one row: nothing to mix along y

    // Transposed: blur_x has no effect, blur_y does all mixing.
    ImageF column(1, 7, 4);
    column.at(0, 3, 0) = 1;
    const Stages upright = dof_stages(flat_planes(column, 0), settings);
    for (int y = 0; y < 7; ++y) {
        EXPECT_EQ(upright.stages.at(stage("blur_x")).at(0, y), y == 3 ? 1 : 0);
        EXPECT_NEAR(upright.stages.at(stage("blur_y")).at(0, y), expected[size_t(y)], kBound);
    }
}

// leak: depth. w = 0.50 0.50 0.51 0.52 0.25; the step 0.50 -> 0.51 is exactly the 1.02 that still
// mixes, up to the rounding of fp32, so 0.509 is used instead. Values 0 0 0 1 2.
// pixel 0: 0.52 > 1.02 * 0.5 is out, 0.25 is beyond the kernel: 0
// pixel 1: pixel 3 out; pixel 4 (behind) three away: (2/512)/(1 + 1/2 + 1/2 + 1/512) = 2/1025
// pixel 2: 0.52 > 0.51918 is out; pixel 4 two away, 1 and 0: weights 1/2, 1/16:
//          (2/16)/(1 + 1/2 + 1/16 + 1/16) = (2/16)/(26/16) = 1/13
// pixel 3: everything is behind it: (1 + 2/2)/(1 + 1/2 + 1/2 + 1/16 + 1/512) = 2/(1057/512)
// pixel 4: everything is in front: itself, 2
TEST(blur_stages, leak_depth_by_hand) {
    FramePlanes planes = flat_planes(row({0, 0, 0, 1, 2}), 0);
    planes[Role::inverse_depth].data = {0.5f, 0.5f, 0.509f, 0.52f, 0.25f};
    expect_row(dof_stages(planes, {{"downsample", int64_t(1)},
                                   {"blur_sigma_px", kHalvingSigma},
                                   {"leak", "depth"s}})
                   .stages.at(stage("blur_x")),
               {0, 2.0 / 1025, 1.0 / 13, 1024.0 / 1057, 2});
}

// leak: coc, R = 32 (1/4 - w): w = 0, 1/4, 1/8, 1/2, 1/4 -> |R| = 8, 0, 4, 8, 0.
// Values 1 2 3 4 5.
// pixel 0: pixel 1 weighs 0; pixel 2 (4/8)(1/16) = 1/32; pixel 3 (8/8)(1/512):
//          (1 + 3/32 + 4/512)/(1 + 1/32 + 1/512) = (512 + 48 + 4)/(512 + 16 + 1) = 564/529
// pixel 1: |R| = 0: all weigh 1: (2 + (1+3)/2 + 4/16 + 5/512)/(1 + 1/2 + 1/2 + 1/16 + 1/512)
//          = (1024 + 1024 + 128 + 5)/(512 + 512 + 32 + 1) = 2181/1057
// pixel 2: pixels 1 and 4 weigh 0; 0 and 3 are larger and weigh 1: (3 + 1/16 + 4/2)/(1 + 1/16
//          + 1/2) = (48 + 1 + 32)/25 = 81/25
// pixel 3: pixel 2 weighs 1/2 * 1/2; 0 three away weighs 1/512: (4 + 3/4 + 1/512)/(1 + 1/4 +
//          1/512) = (2048 + 384 + 1)/(512 + 128 + 1) = 2433/641
// pixel 4: |R| = 0: (5 + 4/2 + 3/16 + 2/512)/(801/512) = (2560 + 1024 + 96 + 2)/801 = 3682/801
TEST(blur_stages, leak_coc_by_hand) {
    FramePlanes planes = flat_planes(row({1, 2, 3, 4, 5}), 0);
    planes[Role::inverse_depth].data = {0, 0.25f, 0.125f, 0.5f, 0.25f};
    expect_row(
        dof_stages(planes,
                   {{"downsample", int64_t(1)}, {"blur_sigma_px", kHalvingSigma}, {"leak", "coc"s}})
            .stages.at(stage("blur_x")),
        {564.0 / 529, 2181.0 / 1057, 81.0 / 25, 2433.0 / 641, 3682.0 / 801});
}

// --------------------------------------------------------------------------------- composite

// A kernel of one tap leaves the box means 0 and 8; all is sky with R = 8 and full
// blur from max(2 * 0, 1) = 1 px on, so only the copy shows, bilinear at (x + 0.5)/4 - 0.5:
// x = 0, 1: -0.375, -0.125, clamped: 0     x = 2: 0.125 -> 1    x = 3: 0.375 -> 3
// x = 4: 0.625 -> 5    x = 5: 0.875 -> 7   x = 6, 7: beyond the last center: 8
TEST(composite_stage, bilinear_by_hand) {
    const FramePlanes planes = flat_planes(row({0, 0, 0, 0, 8, 8, 8, 8}), 0);
    expect_row(dof(planes, {{"blur_sigma_px", 0.0}, {"downsample", int64_t(4)}}),
               {0, 0, 1, 3, 5, 7, 8, 8});
    // At 1/2 of the size the copy is 0 0 8 8: x = 3: 1.25 -> 2; x = 4: 1.75 -> 6.
    expect_row(dof(planes, {{"blur_sigma_px", 0.0}, {"downsample", int64_t(2)}}),
               {0, 0, 0, 2, 6, 8, 8, 8});
}

// sigma = 2: full blur at R = 4; weight smoothstep(0.5, 4, |R|). Three boxes of 4 pixels, 1, 0
// and 0, so that one value v of the downsampled image covers pixels 0 and 1 (left of the first
// center): taps weigh exp(-i^2/(2 (2/4)^2)) = e^-2i^2: v = 1/(1 + e^-2 + e^-8). R at pixel 1 from w
// = 1/4 - R/32, sharp 0 there (and 4/3 at the other three keep the mean 1): R = 0.5: weight 0, the
// sharp 0 exactly       R = 1.375: t = 1/4: t^2 (3 - 2t) = 5/32 R = 2.25: t = 1/2: 1/2 R = 3.125: t
// = 3/4: 27/32 R = 4: 1                                     R = -2.25: 1/2 again, the sign does not
// count
TEST(composite_stage, weight_by_hand) {
    const double v = 1 / (1 + std::exp(-2.0) + std::exp(-8.0));
    const std::pair<double, double> cases[] = {
        {0.5, 0}, {1.375, 5.0 / 32}, {2.25, 0.5}, {3.125, 27.0 / 32}, {4, 1}, {-2.25, 0.5}};
    for (const auto& [radius, weight] : cases) {
        const float third = 4.0f / 3;
        FramePlanes planes =
            flat_planes(row({third, 0, third, third, 0, 0, 0, 0, 0, 0, 0, 0}), 0.25f);
        planes[Role::inverse_depth].at(1, 0) = float(0.25 - radius / 32);
        const Settings settings = {
            {"blur_sigma_px", 2.0}, {"downsample", int64_t(4)}, {"leak", "none"s}};
        EXPECT_NEAR(dof(planes, settings).at(1, 0), weight * v, 2e-6) << radius;
    }
}

// The hint is multiplied by clamp(1 - |R|, 0, 1): |R| = 0, 0.25, 0.5, 0.75, 1, 8.
TEST(composite_stage, hint_by_hand) {
    FramePlanes planes = flat_planes(row({1, 1, 1, 1, 1, 1}), 0);
    planes[Role::inverse_depth].data = {
        0.25f, 0.25f - 0.25f / 32, 0.25f + 0.5f / 32, 0.25f - 0.75f / 32, 0.25f + 1.0f / 32, 0};
    planes[Role::hint] = constant_image(6, 1, {1, 0.5f});
    PlanOptions options{.elide = false, .outputs = {Role::color, Role::hint}};
    const ImageF hint = filter(chain_of("depth_of_field", {{"method", "gilham"}}),
                               describe_round(planes), planes, options)
                            .at(Role::hint);
    const double expected[] = {1, 0.75, 0.5, 0.25, 0, 0};
    for (int x = 0; x < 6; ++x) {
        EXPECT_NEAR(hint.at(x, 0, 0), expected[x], kBound);
        EXPECT_NEAR(hint.at(x, 0, 1), expected[x] / 2, kBound);
    }
}

}  // namespace
}  // namespace postchain::test
