#include "tools/metrics/display.h"

#include <cmath>
#include <limits>

#include "tests/metrics/support.h"
#include "tools/metrics/exposure.h"

namespace postchain::metrics {
namespace {

TEST(Display, Transform) {
    EXPECT_NEAR(display_value(1), std::pow(0.5, 1 / 2.2), 1e-6);
    EXPECT_EQ(display_value(0), 0);
    EXPECT_EQ(display_value(-3), 0);
    EXPECT_NEAR(display_value(float(shown_as(0.5))), 0.5, 1e-6);
    EXPECT_NEAR(display_value(1e10f), 1, 1e-6);
    EXPECT_TRUE(std::isfinite(display_value(std::numeric_limits<float>::max())));
}

// Displayed values 0.5 and 0.6 everywhere: MSE 0.01, 20 dB. In one component of 300: MSE 0.01/300.
TEST(Psnr, OfKnownErrors) {
    const ImageF half = gray(10, 10, shown_as(0.5));
    EXPECT_NEAR(*psnr(pair(gray(10, 10, shown_as(0.6)), half)), 20, 1e-4);
    ImageF test = half;
    test.at(4, 4, 2) = float(shown_as(0.6));
    EXPECT_NEAR(*psnr(pair(test, half)), 20 + 10 * std::log10(300.0), 1e-3);
    EXPECT_FALSE(psnr(pair(half, half)));
}

// An 11 x 11 image is one window. Reference 0; the test is d in its center only: with the center's
// weight w, mean = w d, variance = w d^2 - (w d)^2, covariance 0.
TEST(Ssim, SinglePixel) {
    double side = 0;
    for (int i = -5; i <= 5; ++i) side += std::exp(-i * i / (2 * 1.5 * 1.5));
    const double w = 1 / (side * side), d = 0.8;
    auto test = gray(11, 11, 0);
    for (int c = 0; c < 3; ++c) test.at(5, 5, c) = float(shown_as(d));
    const double mean = w * d, variance = w * d * d - mean * mean;
    const double expected = (1e-4 / (mean * mean + 1e-4)) * (9e-4 / (variance + 9e-4));
    EXPECT_NEAR(*ssim(pair(test, gray(11, 11, 0))), expected, 1e-5);
}

// The window's sum without separation, on an image with several windows.
TEST(Ssim, AgainstTheFullWindow) {
    const auto scene = [](double phase) {
        return make_image(14, 13, [=](int x, int y) {
            return Rgb{1 + std::sin(x * 0.9 + phase), 1 + std::cos(y * 1.3), 0.4 * (x % 3)};
        });
    };
    const Pair both = pair(scene(0.4), scene(0));
    const auto luma = [](const float* rgb) {
        const auto shown = [](double v) { return std::pow(v / (1 + v), 1 / 2.2); };
        return 0.2126 * shown(rgb[0]) + 0.7152 * shown(rgb[1]) + 0.0722 * shown(rgb[2]);
    };
    double total = 0, weight_sum = 0;
    for (int j = -5; j <= 5; ++j)
        for (int i = -5; i <= 5; ++i) weight_sum += std::exp(-(i * i + j * j) / 4.5);
    for (int y = 5; y < 8; ++y)
        for (int x = 5; x < 9; ++x) {
            double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
            for (int j = -5; j <= 5; ++j)
                for (int i = -5; i <= 5; ++i) {
                    const double w = std::exp(-(i * i + j * j) / 4.5) / weight_sum;
                    const double p = luma(both.test.rgb.pixel(x + i, y + j));
                    const double q = luma(both.reference.rgb.pixel(x + i, y + j));
                    a += w * p, b += w * q, aa += w * p * p, bb += w * q * q, ab += w * p * q;
                }
            total += (2 * a * b + 1e-4) * (2 * (ab - a * b) + 9e-4) / (a * a + b * b + 1e-4) /
                     (aa - a * a + bb - b * b + 9e-4);
        }
    EXPECT_NEAR(*ssim(both), total / 12, 1e-5);
}

TEST(Ssim, SmallerThanTheWindowHasNone) {
    for (const auto& [width, height] : {std::pair{10, 40}, {40, 10}, {1, 1}})
        EXPECT_FALSE(ssim(pair(gray(width, height, 1), gray(width, height, 0)))) << width;
}

// The original formula, unlike the single fraction of curve_of().
double hable(double v) {
    const auto part = [](double x) {
        const double a = 0.15, b = 0.5, c = 0.1, d = 0.2, e = 0.02, f = 0.3;
        return (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f;
    };
    return part(2 * v) / part(11.2);
}

TEST(ToneMapper, InverseUndoesTheCurve) {
    for (double value : {0.1, 0.5, 0.85}) {
        double x = inverse_of(ToneMapper::aces, value);
        EXPECT_NEAR((2.51 * 0.36 * x * x + 0.018 * x) / (2.43 * 0.36 * x * x + 0.354 * x + 0.14),
                    value, 1e-6);
        x = inverse_of(ToneMapper::reinhard, value);
        EXPECT_NEAR(x / (1 + x), value, 1e-9);
        EXPECT_NEAR(hable(inverse_of(ToneMapper::hable, value)), value, 1e-6);
    }
}

TEST(ToneMapper, EveryNameIsFound) {
    EXPECT_EQ(tone_mapper_names(), (std::vector<std::string>{"aces", "reinhard", "hable"}));
    for (const auto& name : tone_mapper_names()) EXPECT_EQ(name_of(*find_tone_mapper(name)), name);
    EXPECT_FALSE(find_tone_mapper("ACES"));
}

// A row of grays.
ImageF row_of(const std::vector<double>& values) {
    return make_image(int(values.size()), 1, [&](int x, int) {
        const double v = values[size_t(x)];
        return Rgb{v, v, v};
    });
}

// 1, 2, 3, 4 in shuffled order: element floor(4/2) = 2 of the sorted values is 3, not 2.5 and not
// 2. Zero and negative luminances are left out.
TEST(ExposureRange, MedianIsTheUpperOfTwoOfTheLit) {
    const double x = 0.85 / 0.15;
    for (const auto& values : {std::vector<double>{3, 1, 4, 2}, {0, 3, 0, 1, 0, 4, -5, 2, 0}}) {
        const auto range = exposure_range(one(row_of(values)), ToneMapper::reinhard);
        EXPECT_NEAR(range.start, std::log2(x / 4), 1e-6);
        EXPECT_NEAR(range.stop, std::log2(x / 3), 1e-6);
        EXPECT_EQ(range.count(), 2);
        EXPECT_EQ(range.exposures(), (std::vector<double>{range.start, range.stop}));
    }
}

TEST(ExposureRange, AtMostTwentyStopsOnTheMediansSide) {
    const auto range = exposure_range(one(row_of({0.5, 0.5, 0.5, 1e10})), ToneMapper::aces);
    EXPECT_NEAR(range.stop, std::log2(inverse_of(ToneMapper::aces, 0.85) / 0.5), 1e-6);
    EXPECT_DOUBLE_EQ(range.stop - range.start, 20);
    EXPECT_EQ(range.count(), 20);
}

TEST(ExposureRange, SequencesTakeTheSmallestStartAndTheLargestStop) {
    const ExposureRange a = {-3, 1, true}, b = {-2, 2, true}, black = {};
    const auto both = joined(a, b);
    EXPECT_EQ(both.start, -3);
    EXPECT_EQ(both.stop, 2);
    EXPECT_EQ(both.count(), 5);
    EXPECT_EQ(both.exposures(), (std::vector<double>{-3, -1.75, -0.5, 0.75, 2}));
    EXPECT_EQ(joined(b, {-2, 2.25, true}).count(), 5);
    // A black frame's 0 EV does not count as an exposure.
    const ExposureRange bright = {-9, -4, true}, dark = {3, 5, true};
    EXPECT_EQ(joined(black, bright).stop, -4);
    EXPECT_EQ(joined(dark, black).start, 3);
    EXPECT_FALSE(joined(black, black).lit);
    EXPECT_EQ(joined({-30, 0, true}, {-2, 1, true}).start, -19);
}

}  // namespace
}  // namespace postchain::metrics
