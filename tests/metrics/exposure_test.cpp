#include "tools/metrics/exposure.h"

#include <cmath>

#include "tests/metrics/support.h"

namespace postchain::metrics {
namespace {

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
