#include "tools/metrics/error.h"

#include <cmath>
#include <limits>

#include "tests/metrics/support.h"

namespace postchain::metrics {
namespace {

// The difference is the same in every component.
TEST(Error, ConstantOffset) {
    for (const auto& [test, reference] : {std::pair{0.7, 0.5}, {0.5, 0.0}, {-0.25, 0.5}}) {
        for (const auto& [width, height] : {std::pair{7, 5}, {1, 1}}) {
            const Pair both = pair(gray(width, height, test), gray(width, height, reference));
            const double d = std::abs(test - reference);
            EXPECT_NEAR(mse(both), d * d, 1e-6);
            EXPECT_NEAR(relmse(both) / (d * d / std::pow(reference + 0.01, 2)), 1, 1e-5);
            EXPECT_NEAR(smape(both), 2 * d / (std::abs(test) + reference + 0.02), 1e-6);
            const Percentiles p = difference_percentiles(both);
            for (double v : {p.p50, p.p95, p.p99, p.max}) EXPECT_NEAR(v, d, 1e-6);
        }
    }
}

// One component of one pixel of 4 x 5 differs by 3 from 1.
TEST(Error, SingleComponent) {
    auto test = gray(4, 5, 1);
    test.at(2, 3, 1) = 4;
    const Pair both = pair(test, gray(4, 5, 1));
    EXPECT_NEAR(mse(both), 9.0 / 60, 1e-9);
    EXPECT_NEAR(relmse(both), 9 / (1.01 * 1.01) / 60, 1e-9);
    EXPECT_NEAR(smape(both), 6 / 5.02 / 60, 1e-9);
    EXPECT_NEAR(difference_map(both).at(2, 3), 3, 1e-6);
    EXPECT_NEAR(relmse_map(both).at(2, 3), 3 / (1.01 * 1.01), 1e-6);
    EXPECT_NEAR(smape_map(both).at(2, 3), 2 / 5.02, 1e-6);
    EXPECT_EQ(difference_map(both).at(2, 2), 0);
}

// 2000 pixels: 0.1 % are 2. Three fireflies of (I-R) = 10, 20, 30 on black in all components; the
// two worst are excluded, 10 stays.
TEST(Error, TrimmedLeavesOutTheWorst) {
    auto test = gray(50, 40, 0);
    const int places[3] = {7, 21, 33};
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c) test.at(places[i], 11, c) = float(10 * (i + 1));
    const Pair both = pair(test, gray(50, 40, 0));
    EXPECT_NEAR(relmse_trimmed(both), 100 / 1e-4 / 1998, 1e-3);
    EXPECT_NEAR(relmse(both), 1400 / 1e-4 / 2000, 1e-2);
    // Fewer than 1000 pixels have no worst 0.1 %.
    const Pair small = pair(gray(3, 3, 0.7), gray(3, 3, 0.5));
    EXPECT_DOUBLE_EQ(relmse_trimmed(small), relmse(small));
}

// Differences 1..100 in some order: the p-th percentile is p.
TEST(Error, PercentilesAreNearestRanks) {
    const auto test = make_image(10, 10, [](int x, int y) {
        const double v = 1 + (37 * (x + 10 * y)) % 100;
        return Rgb{v / 2, v, 0.0};  // the largest component counts
    });
    const Percentiles p = difference_percentiles(pair(test, gray(10, 10, 0)));
    EXPECT_EQ(p.p50, 50);
    EXPECT_EQ(p.p95, 95);
    EXPECT_EQ(p.p99, 99);
    EXPECT_EQ(p.max, 100);
    // 0.95 * 20 is 19.000000000000004 in double, whose ceiling would be 20.
    const auto row = make_image(20, 1, [](int x, int) { return Rgb{1.0 + x, 0, 0}; });
    EXPECT_EQ(difference_percentiles(pair(row, gray(20, 1, 0))).p95, 19);
}

TEST(Pair, NonfiniteComponentsBecomeZeroAndPixelsAreCounted) {
    auto test = gray(4, 4, 2);
    test.at(0, 0, 0) = std::numeric_limits<float>::quiet_NaN();
    test.at(0, 0, 1) = std::numeric_limits<float>::infinity();
    test.at(1, 0, 2) = -std::numeric_limits<float>::infinity();
    auto reference = gray(4, 4, 2);
    reference.at(3, 3, 0) = std::numeric_limits<float>::infinity();
    const Pair both = pair(test, reference);
    EXPECT_EQ(both.test.nonfinite, 2u);
    EXPECT_EQ(both.reference.nonfinite, 1u);
    EXPECT_EQ(both.test.rgb.at(0, 0, 0), 0);
    EXPECT_EQ(both.test.rgb.at(0, 0, 2), 2);
    // Four components differ by 2.
    EXPECT_NEAR(mse(both), 4 * 4.0 / 48, 1e-9);
}

TEST(Pair, AlphaIsNotCompared) {
    ImageF a(2, 2, 4, 0.5f), b(2, 2, 4, 0.5f);
    b.at(1, 1, 3) = 0;
    EXPECT_EQ(mse(pair(a, b)), 0);
}

TEST(Pair, RefusesWhatIsNoPair) {
    EXPECT_EQ(pair_of(gray(3, 2, 0), gray(2, 3, 0)).status().code(), StatusCode::input);
    EXPECT_EQ(pair_of(ImageF(), ImageF()).status().code(), StatusCode::input);
    EXPECT_EQ(pair_of(gray(3, 2, 0), ImageF()).status().message(),
              "reference: the image has no pixels");
    EXPECT_EQ(pair_of(ImageF(2, 2, 1), ImageF(2, 2, 1)).status().code(), StatusCode::input);
}

}  // namespace
}  // namespace postchain::metrics
