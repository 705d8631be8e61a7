#include "tools/metrics/sharpness.h"

#include <algorithm>
#include <cmath>

#include "tests/metrics/support.h"

namespace postchain::metrics::sharpness_test {
namespace {

// Display values: an edge at x = 30 from 0.2 to 0.2 + left, `width` pixels wide (a linear ramp),
// and a hard edge at x = 90 that adds `right`.
ImageF edges(double left, int width, double right) {
    return make_image(120, 40, [=](int x, int) {
        const double ramp = std::clamp((x - 30 + width / 2.0) / width, 0.0, 1.0);
        const double v = shown_as(0.2 + left * ramp + (x >= 90 ? right : 0));
        return Rgb{v, v, v};
    });
}

Sharpness measure(const ImageF& image, const ImageF& truth, const ImageF& input) {
    return test::must(sharpness(pair(image, truth), one(input)));
}

// An edge of height h over one halfway column has the gradients h/4, h/2, h/4; in the ground truth
// it is a ramp of 12 steps h/12: 11 columns with that gradient and one with half of it at each end.
// A Gaussian of 3 pixels, cut at 9, spreads both energies. Only the left edge blurs.
TEST(Sharpness, EdgeLeftInABlurredRegion) {
    const double h = 0.4;
    double before[120] = {}, after[120] = {};
    const auto spread = [](double* to, int at, double energy) {
        double total = 0;
        for (int i = -9; i <= 9; ++i) total += std::exp(-i * i / 18.0);
        for (int i = -9; i <= 9; ++i) to[at + i] += energy * std::exp(-i * i / 18.0) / total;
    };
    for (int i = -1; i <= 1; ++i) spread(before, 30 + i, i == 0 ? h * h / 4 : h * h / 16);
    for (int i = -6; i <= 6; ++i)
        spread(after, 30 + i, std::abs(i) == 6 ? h * h / 576 : h * h / 144);
    double test_energy = 0, truth_energy = 0;
    size_t columns = 0;
    for (int x = 0; x < 60; ++x)
        if (before[x] >= 5e-4 && after[x] <= before[x] / 2) {
            ++columns;
            test_energy += before[x] + 1e-6;
            truth_energy += after[x] + 1e-6;
        }
    const auto input = edges(h, 1, 0.3), truth = edges(h, 12, 0.3);
    const Sharpness s = measure(input, truth, input);
    EXPECT_EQ(s.blurred_pixels, 40 * columns);
    EXPECT_NEAR(*s.edges_in_blurred, test_energy / truth_energy, 1e-4);
    EXPECT_DOUBLE_EQ(*s.sharpness_in_focus, 1);
}

// The test's right edge has half the height: a quarter of the energy.
TEST(Sharpness, SofterInFocus) {
    const auto input = edges(0.4, 1, 0.3), truth = edges(0.4, 12, 0.3);
    const Sharpness s = measure(edges(0.4, 12, 0.15), truth, input);
    EXPECT_NEAR(*s.sharpness_in_focus, 0.25, 0.002);
    EXPECT_DOUBLE_EQ(*s.edges_in_blurred, 1);
}

// The ground truth's left edge is harder than the input's, and the test has none.
TEST(Sharpness, WhatTheGroundTruthSharpensIsNotInFocus) {
    const Sharpness s = measure(edges(0, 1, 0.3), edges(0.4, 1, 0.3), edges(0.4, 12, 0.3));
    EXPECT_GT(*s.sharpness_in_focus, 0.9);
    EXPECT_FALSE(s.edges_in_blurred);
}

// A lamp out of focus has a rim elsewhere: as many edges as before, at other places.
TEST(Sharpness, WhatTheGroundTruthShowsElsewhereIsNotInFocus) {
    for (const int shift : {-2, 2}) {
        const auto input = make_image(120, 40, [](int x, int) {
            const double v = shown_as(x >= 60 ? 0.6 : 0.2);
            return Rgb{v, v, v};
        });
        const auto truth = make_image(120, 40, [=](int x, int) {
            const double v = shown_as(x >= 60 + shift ? 0.6 : 0.2);
            return Rgb{v, v, v};
        });
        EXPECT_EQ(measure(truth, truth, input).sharp_pixels, 0u) << shift;
    }
}

// The same of edges along x, which have no gradient but along y.
TEST(Sharpness, DoesNotDependOnTheDirection) {
    const auto turned = [](const ImageF& image) {
        return make_image(image.height, image.width, [&](int x, int y) {
            return Rgb{image.at(y, x, 0), image.at(y, x, 1), image.at(y, x, 2)};
        });
    };
    const auto input = edges(0.4, 1, 0.3), truth = edges(0.4, 12, 0.3), test = edges(0.3, 9, 0.15);
    const Sharpness a = measure(test, truth, input);
    const Sharpness b = measure(turned(test), turned(truth), turned(input));
    EXPECT_EQ(a.blurred_pixels, b.blurred_pixels);
    EXPECT_EQ(a.sharp_pixels, b.sharp_pixels);
    EXPECT_NEAR(*a.edges_in_blurred, *b.edges_in_blurred, 1e-6);
    EXPECT_NEAR(*a.sharpness_in_focus, *b.sharpness_in_focus, 1e-6);
}

TEST(Sharpness, RegionsDoNotDependOnTheTest) {
    const auto input = edges(0.4, 1, 0.3), truth = edges(0.4, 12, 0.3);
    const Sharpness a = measure(truth, truth, input), b = measure(gray(120, 40, 9), truth, input);
    EXPECT_GT(a.blurred_pixels, 100u);
    EXPECT_GT(a.sharp_pixels, 100u);
    EXPECT_EQ(a.blurred_pixels, b.blurred_pixels);
    EXPECT_EQ(a.sharp_pixels, b.sharp_pixels);
    EXPECT_LT(*b.edges_in_blurred, 0.01);
}

TEST(Sharpness, WithoutRegionsThereIsNoValue) {
    for (const int side : {1, 20}) {
        const ImageF image = gray(side, side, 1);
        const Sharpness flat = measure(image, image, image);
        EXPECT_FALSE(flat.edges_in_blurred || flat.sharpness_in_focus) << side;
    }
    const auto input = edges(0.4, 1, 0.3);
    const Sharpness all_sharp = measure(input, input, input);
    EXPECT_FALSE(all_sharp.edges_in_blurred);
    EXPECT_TRUE(all_sharp.sharpness_in_focus);
}

// One edge in a picture that grows beside it.
TEST(Sharpness, ARegionOfAFewPixelsHasNoValue) {
    const auto one_edge = [](int width) {
        return make_image(width, 20, [](int x, int) {
            const double v = shown_as(x < 10 ? 0.2 : 0.6);
            return Rgb{v, v, v};
        });
    };
    const size_t region = measure(one_edge(100), one_edge(100), one_edge(100)).sharp_pixels;
    ASSERT_GT(region, 100u);
    for (const int side : {-1, 1}) {
        const ImageF image = one_edge(int(region * 10) + side);
        const Sharpness s = measure(image, image, image);
        EXPECT_EQ(s.sharp_pixels, region);
        EXPECT_EQ(s.sharpness_in_focus.has_value(), side < 0) << side;
    }
}

TEST(Sharpness, RefusesAnInputOfAnotherSize) {
    for (const auto& [width, height] : {std::pair(4, 5), {5, 4}})
        EXPECT_EQ(sharpness(pair(gray(4, 4, 0), gray(4, 4, 0)), one(gray(width, height, 0)))
                      .status()
                      .code(),
                  StatusCode::input);
}

}  // namespace
}  // namespace postchain::metrics::sharpness_test
