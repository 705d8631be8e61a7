#include "tools/metrics/display.h"

#include <cmath>
#include <limits>

#include "tests/metrics/support.h"

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

}  // namespace
}  // namespace postchain::metrics
