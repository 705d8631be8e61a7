// Quantiles, intervals and the bootstrap against tables, closed forms and hand computation.
#include "tools/measure/experiment/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

namespace postchain::experiment {

using namespace report;
namespace {

TEST(StudentT, QuantilesOfTheTables) {
    // Two-sided 95 %: the column 0.975 of any table of Student's t.
    const std::pair<int, double> table[] = {{1, 12.7062},  {2, 4.30265},  {3, 3.18245},
                                            {4, 2.77645},  {7, 2.36462},  {9, 2.26216},
                                            {29, 2.04523}, {120, 1.97993}};
    for (const auto& [degrees, t] : table)
        EXPECT_NEAR(t_quantile(0.975, degrees), t, 6e-6 * t) << degrees;
    EXPECT_NEAR(t_quantile(0.995, 5), 4.03214, 1e-5);
    EXPECT_NEAR(t_quantile(0.975, 1000000), 1.95996, 1e-5);  // the normal distribution
}

// One degree is the Cauchy distribution.
TEST(StudentT, ClosedFormOfOneDegree) {
    for (const double p : {0.1, 0.6, 0.9995})
        EXPECT_NEAR(t_quantile(p, 1) / std::tan(std::numbers::pi * (p - 0.5)), 1, 1e-9) << p;
    EXPECT_NEAR(t_cumulative(1, 1), 0.75, 1e-12);
}

TEST(PairedInterval, ByHand) {
    // 1, 2, 3, 6: mean 3; squares 4 + 1 + 0 + 9 = 14; s = sqrt(14/3) = 2.160247; s / sqrt 4 =
    // 1.080123; times t(0.975, 3) = 3.182446: 3.437434.
    const Paired paired = paired_interval({1, 2, 3, 6});
    EXPECT_EQ(paired.n, 4);
    EXPECT_DOUBLE_EQ(paired.mean, 3);
    ASSERT_TRUE(paired.interval);
    EXPECT_NEAR(paired.interval->low, 3 - 3.437434, 1e-5);
    EXPECT_NEAR(paired.interval->high, 3 + 3.437434, 1e-5);
}

TEST(PairedInterval, NoneBelowTwoAndNoWidthForEqualOnes) {
    EXPECT_FALSE(paired_interval({}).interval || paired_interval({0.5}).interval);
    const Paired equal = paired_interval({0.25, 0.25, 0.25});
    EXPECT_EQ(equal.interval->low, 0.25);
    EXPECT_EQ(equal.interval->high, 0.25);
}

TEST(Probabilities, DoNotDependOnTheSign) {
    for (const double sign : {1.0, -1.0}) {
        // Mean 3, error 1, one degree: 1/2 + atan(t) / pi.
        const Paired paired = paired_interval({2 * sign, 4 * sign});
        EXPECT_NEAR(difference_probability(paired), 1 - 2 * std::atan(3) / std::numbers::pi, 1e-12);
        EXPECT_NEAR(equivalence_probability(paired, 1), 0.5 + std::atan(2) / std::numbers::pi,
                    1e-12);
        EXPECT_NEAR(equivalence_probability(paired, 5), 0.5 - std::atan(2) / std::numbers::pi,
                    1e-12);
        const Paired equal = paired_interval({3 * sign, 3 * sign});
        EXPECT_EQ(difference_probability(equal), 0);
        EXPECT_EQ(equivalence_probability(equal, 2), 1);
        EXPECT_EQ(equivalence_probability(equal, 3), 0.5);
        EXPECT_EQ(equivalence_probability(equal, 4), 0);
    }
    EXPECT_EQ(difference_probability(paired_interval({0, 0})), 1);
}

TEST(TileSums, BorderTilesAreSmaller) {
    // 5x3 pixels in tiles of 2: 3 across, 2 down; b - a = 1 everywhere except 11 at (4, 2).
    const ImageF a(5, 3, 1, 2.0f);
    ImageF b(5, 3, 1, 3.0f);
    b.at(4, 2) = 13;
    const TileSums tiles = tile_sums(a, b, 2);
    EXPECT_EQ(tiles.pixels, (std::vector<double>{4, 4, 2, 2, 2, 1}));
    EXPECT_EQ(tiles.sums, (std::vector<double>{4, 4, 2, 2, 2, 11}));
}

TileSums tiles_of(const std::vector<double>& means, double pixels = 1) {
    TileSums tiles;
    for (double mean : means) {
        tiles.sums.push_back(mean * pixels);
        tiles.pixels.push_back(pixels);
    }
    return tiles;
}

TEST(Bootstrap, TwoTilesHaveTheBinomialsInterval) {
    // Two draws of -1 and 1: mean -1, 0, 1 with 1/4, 1/2, 1/4: 2.5 % and 97.5 % are the ends.
    TileBootstrap bootstrap(1, 2000);
    bootstrap.add(10, tiles_of({-1, 1}));
    EXPECT_EQ(bootstrap.interval()->low, -1);
    EXPECT_EQ(bootstrap.interval()->high, 1);
    EXPECT_EQ(bootstrap.tiles(), 2);
    EXPECT_FALSE(TileBootstrap(1, 10).interval());
}

TEST(Bootstrap, IntervalOfManyTilesIsTheNormalOne) {
    // 400 tiles, half 0 and half 1: standard error 0.5 / 20 = 0.025, so 0.5 -+ 1.96 * 0.025.
    std::vector<double> means(400, 0.0);
    for (size_t i = 0; i < 200; ++i) means[i] = 1;
    TileBootstrap bootstrap(7, 4000);
    bootstrap.add(1, tiles_of(means));
    // 4000 replicates leave a deviation of 0.001, and means are multiples of 0.0025.
    EXPECT_NEAR(bootstrap.interval()->low, 0.451, 0.006);
    EXPECT_NEAR(bootstrap.interval()->high, 0.549, 0.006);
}

TEST(Bootstrap, FramesAreDrawnApartAndWeighTheSame) {
    // Frames are not resampled: two frames without variation give an interval of zero width.
    TileBootstrap bootstrap(1, 100);
    bootstrap.add(1, tiles_of({0.1, 0.1, 0.1}));
    bootstrap.add(2, tiles_of({0.3, 0.3}, 50));
    EXPECT_NEAR(bootstrap.interval()->low, 0.2, 1e-12);
    EXPECT_NEAR(bootstrap.interval()->high, 0.2, 1e-12);
    EXPECT_EQ(bootstrap.frames(), 2);
}

// Border tiles are smaller: one pixel of 8 and three of 0 have the mean 8, 2 or 0.
TEST(Bootstrap, TilesCountByTheirPixels) {
    TileSums tiles;
    tiles.sums = {8, 0};
    tiles.pixels = {1, 3};
    std::set<double> means;
    for (uint64_t seed = 0; seed < 20; ++seed) {
        TileBootstrap one(seed, 1);
        one.add(1, tiles);
        means.insert(one.interval()->low);
    }
    EXPECT_EQ(means, (std::set<double>{0, 2, 8}));
}

TEST(Bootstrap, EveryFrameHasItsOwnDraws) {
    const auto width = [](const std::vector<std::pair<int, std::vector<double>>>& frames) {
        TileBootstrap bootstrap(1, 1000);
        for (const auto& [frame, means] : frames) bootstrap.add(frame, tiles_of(means));
        return bootstrap.interval()->high - bootstrap.interval()->low;
    };
    const std::vector<double> up = {1, 2, 3, 4, 5, 6}, down = {6, 5, 4, 3, 2, 1};
    const double one = width({{1, up}});
    // With the draws of frame 1, frame 2 would be as far above the mean as frame 1 is below.
    EXPECT_GT(width({{1, up}, {2, down}}), 0.5 * one);
    EXPECT_LT(width({{1, up}, {2, up}}), 0.9 * one);
    EXPECT_EQ(width({{1, up}, {2, down}}), width({{2, down}, {1, up}}));
}

TEST(Bootstrap, DrawsTheSameForEveryMetric) {
    const std::vector<double> means = {0.1, -0.4, 0.3, 0.9, 0.2, -0.1, 0.05};
    const auto run = [&](uint64_t seed, double scale) {
        std::vector<double> scaled = means;
        for (double& m : scaled) m *= scale;
        TileBootstrap bootstrap(seed, 300);
        bootstrap.add(3, tiles_of(scaled));
        return *bootstrap.interval();
    };
    EXPECT_NE(run(5, 1).low, run(6, 1).low);
    // The same draws: twice the values, twice the interval.
    EXPECT_DOUBLE_EQ(run(5, 2).low, 2 * run(5, 1).low);
}

TEST(TimeFigure, MedianAndQuartilesBetweenRanks) {
    // Sorted 1 2 4 8: quartiles at ranks 0.75 and 2.25: 1.75 and 5; median 3.
    const TimeFigure figure = time_figure({8, 1, 4, 2});
    EXPECT_EQ(figure.n, 4);
    EXPECT_DOUBLE_EQ(figure.median_ms, 3);
    EXPECT_DOUBLE_EQ(figure.spread_ms, 3.25);
    EXPECT_DOUBLE_EQ(time_figure({7}).median_ms, 7);
    EXPECT_DOUBLE_EQ(time_figure({7}).spread_ms, 0);
}

}  // namespace
}  // namespace postchain::experiment
