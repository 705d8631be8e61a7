// Estimates noise of known standard deviation.
#include "tools/metrics/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/metrics/support.h"

namespace postchain::metrics::noise_test {
namespace {

double deviation(const ImageF& variance) {
    double sum = 0;
    for (const float v : variance.data) sum += double(v);
    return std::sqrt(sum / double(variance.data.size()));
}

// One channel of `f` with normal noise of standard deviation s(x, y).
template <class F, class S>
ImageF noisy(int width, int height, const F& f, const S& s) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    ImageF image(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image.at(x, y) = float(f(x, y) + s(x, y) * normal(random));
    return image;
}

// A median of 64 correlated values: its square exceeds the variance by a few percent on average.
TEST(Noise, WhiteNoiseOnFlatRampAndEdgesAlongTheAxes) {
    const auto flat = [](int, int) { return 0.5; };
    const auto ramp = [](int x, int y) { return 0.01 * x - 0.02 * y + 0.001 * x * y; };
    const auto edges = [](int x, int y) { return (x >= 30 ? 0.4 : 0) + (y >= 21 ? 0.3 : 0); };
    for (const double s : {0.003, 0.02, 0.1}) {
        const auto sigma = [=](int, int) { return s; };
        EXPECT_NEAR(deviation(noise_variance(noisy(128, 96, flat, sigma))), s, 0.06 * s);
        EXPECT_NEAR(deviation(noise_variance(noisy(128, 96, ramp, sigma))), s, 0.06 * s);
        EXPECT_NEAR(deviation(noise_variance(noisy(128, 96, edges, sigma))), s, 0.06 * s);
    }
}

// A disc: edges in all directions and no noise.
TEST(Noise, EdgesAreNoNoise) {
    const auto disc = [](int x, int y) { return std::hypot(x - 64, y - 48) < 30 ? 0.8 : 0.2; };
    const ImageF clean = noisy(128, 96, disc, [](int, int) { return 0.0; });
    EXPECT_LT(deviation(noise_variance(clean)), 1e-6);
}

// Noise only in the left half: s^2 is found there, and the mean is that of the halves.
TEST(Noise, IsFoundWhereItIs) {
    const ImageF variance = noise_variance(noisy(
        128, 96, [](int, int) { return 0.5; }, [](int x, int) { return x < 64 ? 0.05 : 0.0; }));
    EXPECT_GT(variance.at(20, 20), 0.03 * 0.03);
    EXPECT_LT(variance.at(100, 20), 1e-9);
    EXPECT_NEAR(deviation(variance), 0.05 / std::sqrt(2), 0.004);
}

// The last column, or row, is beyond whole tiles: its tile is the one before.
TEST(Noise, TilesAtTheBordersAreWhole) {
    for (const auto& [more_x, more_y] : {std::pair{1, 0}, {0, 1}}) {
        const int width = 2 * kNoiseTile + more_x, height = 2 * kNoiseTile + more_y;
        const ImageF variance = noise_variance(noisy(
            width, height, [](int, int) { return 0.5; }, [](int, int) { return 0.02; }));
        EXPECT_GT(variance.at(width - 1, height - 1), 0);
        EXPECT_EQ(variance.at(width - 1, height - 1),
                  variance.at(width - 1 - more_x, height - 1 - more_y))
            << more_x;
    }
}

TEST(Noise, SmallPicturesHaveNone) {
    for (const auto& [width, height] : {std::pair{1, 1}, {2, 9}, {9, 2}, {3, 3}})
        EXPECT_EQ(deviation(noise_variance(ImageF(width, height, 1, 0.5f))), 0);
    // A pixel of 6 has the residual 4, and 2 beside it along an axis: 4, or the mean of 4 and 2.
    for (const auto& [width, height, residual] : {std::tuple(3, 3, 4), {4, 3, 3}, {3, 4, 3}}) {
        ImageF dot(width, height, 1);
        dot.at(1, 1) = 6;
        EXPECT_NEAR(deviation(noise_variance(dot)), residual / kNormalMedian, 1e-6) << width;
    }
}

// Three channels, each with the values of `gray`.
template <class F>
ImageF rgb_of(const ImageF& gray, const F& scene_value) {
    return make_image(gray.width, gray.height, [&](int x, int y) {
        const double v = scene_value(double(gray.at(x, y)));
        return Rgb{v, v, v};
    });
}

// Displayed gray with noise of s, and vertical edges of height h every 8 pixels (over one halfway
// column: h^2/16 + h^2/4 + h^2/16 of gradient energy), the same in input and ground truth. The
// noise adds s^2 to every pixel's energy.
TEST(Noise, WhatAPictureWithoutErrorWouldHave) {
    const double h = 0.3, s = 0.012;
    const auto gray = [=](int x, int) {
        const int at = x % 16;
        return 0.3 + (at == 0 ? h / 2 : at < 8 ? h : at == 8 ? h / 2 : 0);
    };
    const ImageF clean = rgb_of(noisy(160, 96, gray, [](int, int) { return 0.0; }), shown_as);
    const ImageF truth = rgb_of(noisy(160, 96, gray, [=](int, int) { return s; }), shown_as);
    const TruthNoise noise = test::must(truth_noise(one(truth), one(clean)));
    EXPECT_NEAR(noise.sigma, s, 0.06 * s);
    const double energy = h * h * (1.0 / 16 + 1.0 / 4 + 1.0 / 16) / 8;  // mean of a period
    EXPECT_NEAR(noise.of_no_error.at("sharpness_in_focus"), energy / (energy + s * s), 0.02);
    EXPECT_NEAR(noise.of_no_error.at("psnr"), -20 * std::log10(s), 0.5);
    EXPECT_FALSE(noise.of_no_error.contains("edges_in_blurred"));
    EXPECT_NEAR(truth_noise(one(clean), one(clean))->of_no_error.at("sharpness_in_focus"), 1, 1e-6);
    EXPECT_FALSE(truth_noise(one(truth), one(ImageF(8, 8, 3, 0.5f))).ok());
}

// Linear values: mse is s^2, independent of the display transform, and a third if one channel alone
// is noisy; psnr is 10 log10(3) higher then.
TEST(Noise, MseOfNoErrorIsTheVariance) {
    const double s = 0.05;
    const ImageF gray = noisy(
        128, 96, [](int, int) { return 2.0; }, [=](int, int) { return s; });
    const ImageF image = rgb_of(gray, [](double v) { return v; });
    const auto all = test::must(truth_noise(one(image), one(image))).of_no_error;
    EXPECT_NEAR(all.at("mse"), s * s, 0.12 * s * s);
    for (int c = 0; c < 3; ++c) {
        ImageF alone(128, 96, 3, 2.0f);
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 128; ++x) alone.at(x, y, c) = image.at(x, y, c);
        const auto third = test::must(truth_noise(one(alone), one(alone))).of_no_error;
        EXPECT_NEAR(third.at("mse"), all.at("mse") / 3, 1e-9) << c;
        EXPECT_NEAR(third.at("psnr"), all.at("psnr") + 10 * std::log10(3), 1e-6) << c;
    }
}

}  // namespace
}  // namespace postchain::metrics::noise_test
