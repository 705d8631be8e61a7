// The GPU against the double-precision reference at every stage boundary: sizes, kernels and values
// of any size. (Each source, leak test and factor: tests/conformance.)
//
// Bounds, |a - b| / max(1, |b|) at fp32 storage: coc 1e-5 (R is up to 19 px: a few roundings of
// 2^-24), all others 2e-5. Color reaches 4.
#include <gtest/gtest.h>

#include "tests/depth_of_field/support.h"

namespace postchain::test {
namespace {

constexpr double kCocBound = 1e-5;
constexpr double kColorBound = 2e-5;

void expect_stages_match(const FramePlanes& planes, Settings settings) {
    const Stages gpu = dof_stages(planes, settings);
    const ReferenceFrame reference = dof_reference(planes, settings);
    EXPECT_EQ(gpu.stages.size(), reference.stages.size());
    for (const auto& [name, expected] : reference.stages) {
        ASSERT_TRUE(gpu.stages.count(name)) << name;
        const double bound = name == stage("coc") ? kCocBound : kColorBound;
        const Difference difference = compare(gpu.stages.at(name), expected, bound);
        EXPECT_LE(difference.max, bound) << name << ": " << difference.text;
    }
}

TEST(every_stage, equals_the_reference_at_any_size_and_kernel) {
    for (const char* leak : {"none", "coc"}) {
        // Around the box and the work group.
        for (const auto& [width, height] :
             {std::pair{1, 1}, {1, 7}, {5, 1}, {3, 3}, {17, 15}, {67, 5}}) {
            SCOPED_TRACE(concat(width, "x", height, " leak ", leak));
            expect_stages_match(deep_planes(width, height), {{"leak", leak}});
        }
        for (const double sigma : {0.0, 0.3, 4.0, 33.4, 500.0}) {
            SCOPED_TRACE(concat("sigma ", sigma, " leak ", leak));
            expect_stages_match(
                deep_planes(40, 30),
                {{"blur_sigma_px", sigma}, {"downsample", int64_t(1)}, {"leak", leak}});
        }
    }
}

// A dot of one pixel, its kernel inside the image, one |R| everywhere: box mean, Gaussian and
// bilinear up-sampling each keep the sum (the up-sampling's weights of one texel add to
// downsample^2). Bound: 1e-5 of the dot's energy, whatever the leak test.
TEST(every_stage, keeps_the_energy_of_a_dot) {
    for (const int factor : {1, 2, 4})
        for (const char* leak : {"none", "depth", "coc"})
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

// Half holds at most 65504: larger values saturate in the blurred image and stay finite highlights.
// (If a driver rounds towards zero, as llvmpipe does, the store would suffice.) The result keeps
// the input's values.
TEST(every_stage, half_storage_stays_finite) {
    FramePlanes planes = deep_planes(40, 30);
    planes[Role::color].at(11, 9, 0) = 1e10f;
    planes[Role::color].at(30, 20, 1) = -1e10f;
    PlanOptions half{.precision = Precision::fp16, .elide = false};
    const Stages gpu = filter_with_stages(chain_of("depth_of_field", {{"method", "gilham"}}),
                                          describe_round(planes), planes, half);
    for (const auto& [name, image] : gpu.stages)
        for (const float value : image.data)
            ASSERT_LE(std::abs(value), name == stage("color") ? 1e10f : 65504.0f) << name;
}

}  // namespace
}  // namespace postchain::test
