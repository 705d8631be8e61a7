// Denoising of few samples with method inverse_warp: its gain, and the parts it must not change.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/depth_of_field/support.h"

namespace postchain::test::denoise_test {
namespace {

const std::pair<std::string, ParameterValue> kMethod = {"method", "inverse_warp"};

ImageF blurred(const FramePlanes& planes, int samples, bool denoise, int seed = 0) {
    return dof(
        planes,
        {kMethod, {"samples", int64_t(samples)}, {"denoise", denoise}, {"seed", int64_t(seed)}});
}

// Inverse depth 0.25 is in focus, 0.75 has a radius of 16 px, 1 of 24.

// For a noise image, the mean over 1023 points is the ground truth.
TEST(Denoise, AThirdOfTheErrorAtMost) {
    const FramePlanes planes = flat_planes(noise_image(96, 96, 4, 5), 0.75f);
    const ImageF truth = blurred(planes, 1023, false);
    const auto squared_error = [&](bool denoise) {
        const ImageF out = blurred(planes, 32, denoise);
        double sum = 0;
        for (size_t i = 0; i < out.data.size(); ++i)
            sum += std::pow(out.data[i] - truth.data[i], 2);
        return sum;
    };
    EXPECT_LT(squared_error(true), 0.33 * squared_error(false));
}

// With many points there is little noise: a lamp's disc keeps its rim.
TEST(Denoise, ManyPointsKeepTheRim) {
    const FramePlanes planes = planes_at(97, 97, [](int x, int y) {
        return Pixel{std::max(std::abs(x - 48), std::abs(y - 48)) <= 4 ? 30.0 : 0, 1};
    });
    const Difference difference =
        compare(blurred(planes, 1023, true), blurred(planes, 1023, false), 0.05);
    EXPECT_LE(difference.max, 0.2) << difference.text;
    EXPECT_LE(difference.fraction, 0.01) << difference.text;
}

TEST(Denoise, SmallCirclesOfConfusionAreLeftAlone) {
    const FramePlanes planes = flat_planes(noise_image(64, 64, 4, 5), 0.25f + 3.0f / 32);
    EXPECT_TRUE(equal_bits(blurred(planes, 24, true), blurred(planes, 24, false)));
}

// A fence in focus, every other pixel, before an out-of-focus background: its samples are not mixed
// with those of its gaps.
TEST(Denoise, WhatIsInFocusKeepsItsDetail) {
    const FramePlanes planes = planes_at(96, 64, [](int x, int) {
        return x % 2 == 0 ? Pixel{1, 0.25f} : Pixel{0, 0};  // in focus; 8 px
    });
    const ImageF with = blurred(planes, 24, true);
    for (int x = 16; x < 80; x += 2) EXPECT_NEAR(with.at(x, 32), 1, 1e-6) << x;
}

// Premultiplied: white on clear stays white, whatever its alpha.
TEST(Denoise, ColorAndAlphaAreMixedAlike) {
    const ImageF color =
        make_image(96, 64, 4, [](int x, int y, int) { return (x / 9 + y / 7) % 2 == 0; });
    const ImageF out = blurred(flat_planes(color, 0.75f), 16, true);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x)
            EXPECT_NEAR(out.at(x, y, 0), out.at(x, y, 3), 1e-6) << x << ", " << y;
}

}  // namespace
}  // namespace postchain::test::denoise_test
