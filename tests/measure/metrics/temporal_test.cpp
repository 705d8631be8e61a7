#include "tools/measure/metrics/temporal.h"

#include <cmath>

#include "tests/measure/metrics/support.h"

namespace postchain::metrics::temporal_test {
namespace {

// A constant error does not count, however large; one that grows by 0.25 per frame does.
TEST(TemporalError, CountsTheChangeOfTheErrorAlone) {
    TemporalError still, growing;
    for (int t = 0; t < 4; ++t) {
        const auto truth = gray(5, 4, 0.1 * t);
        ASSERT_TRUE(still.add(pair(gray(5, 4, 0.1 * t + 3), truth)).ok());
        ASSERT_TRUE(growing.add(pair(gray(5, 4, 0.1 * t + 0.25 * t), truth)).ok());
    }
    EXPECT_EQ(growing.steps(), 3);
    EXPECT_NEAR(*still.mean(), 0, 1e-6);
    EXPECT_NEAR(*growing.mean(), 0.25, 1e-6);
    EXPECT_NEAR(*growing.last(), 0.25, 1e-6);
}

// A single pixel of 4 x 5 that is too bright by 2 in the middle frame of three: it appears and
// disappears, each time 2/20 in the mean.
TEST(TemporalError, SinglePixelThatFlickers) {
    TemporalError error;
    auto test = gray(4, 5, 1);
    const auto truth = gray(4, 5, 1);
    ASSERT_TRUE(error.add(pair(test, truth)).ok());
    EXPECT_FALSE(error.mean());
    for (int c = 0; c < 3; ++c) test.at(2, 2, c) = 3;
    ASSERT_TRUE(error.add(pair(test, truth)).ok());
    ASSERT_TRUE(error.add(pair(truth, truth)).ok());
    EXPECT_NEAR(*error.mean(), 0.1, 1e-9);
}

// Values 1, 2, 3, 4 have the sample deviation sqrt(5/3); one of two pixels flickers.
TEST(Flicker, SampleDeviation) {
    Flicker flicker;
    for (int seed = 1; seed <= 4; ++seed) {
        auto image = gray(2, 1, 7);
        for (int c = 0; c < 3; ++c) image.at(1, 0, c) = float(seed);
        ASSERT_TRUE(flicker.add(one(image)).ok());
    }
    EXPECT_EQ(flicker.seeds(), 4);
    EXPECT_NEAR(*flicker.mean(), std::sqrt(5.0 / 3) / 2, 1e-9);
}

// A constant offset of a million must not cancel the deviation.
TEST(Flicker, IsNumericallyStable) {
    Flicker flicker;
    for (int seed = 0; seed < 10; ++seed)
        ASSERT_TRUE(flicker.add(one(gray(1, 1, 1e6 + seed % 2))).ok());
    EXPECT_NEAR(*flicker.mean(), std::sqrt(10 * 0.25 / 9), 1e-6);
}

TEST(Flicker, NeedsTwoOfOneSizeAndSoDoesTemporalError) {
    Flicker flicker;
    EXPECT_FALSE(flicker.mean());
    ASSERT_TRUE(flicker.add(one(gray(2, 2, 1))).ok());
    EXPECT_FALSE(flicker.mean());
    EXPECT_EQ(flicker.add(one(gray(2, 3, 1))).code(), StatusCode::input);
    EXPECT_EQ(flicker.seeds(), 1);
    TemporalError error;
    ASSERT_TRUE(error.add(pair(gray(4, 4, 0), gray(4, 4, 0))).ok());
    EXPECT_EQ(error.add(pair(gray(4, 5, 0), gray(4, 5, 0))).code(), StatusCode::input);
}

ImageF scene() {
    return make_image(24, 20, [](int x, int y) {
        return Rgb{std::sin(x * 0.8 + y), std::cos(y * 0.5), 0.1 * ((x * 7 + y * 3) % 11)};
    });
}

TEST(Shifted, MovesTheContent) {
    const auto image = scene();
    const auto moved = shifted(image, 3, -2);
    EXPECT_EQ(moved.at(10, 5, 1), image.at(7, 7, 1));
    EXPECT_EQ(moved.at(0, 19, 0), image.at(0, 19, 0));
}

// A pointwise filter, and a mean of three with its reach as margin, have no grid.
TEST(GridError, FiltersWithoutAGridHaveNone) {
    const auto mean_of_three = [](const ImageF& image) {
        return make_image(image.width, image.height, [&](int x, int y) {
            Rgb sum = {0, 0, 0};
            for (int dx = -1; dx <= 1; ++dx)
                for (int c = 0; c < 3; ++c)
                    sum[size_t(c)] += image.at(std::clamp(x + dx, 0, image.width - 1), y, c) / 3;
            return sum;
        });
    };
    GridError error(1);
    for (const int k : {1, 2, 3, 4, -1, -2, -3, -4})
        ASSERT_TRUE(error
                        .add(one(mean_of_three(shifted(scene(), k, -k))),
                             one(mean_of_three(scene())), k, -k)
                        .ok());
    EXPECT_EQ(error.shifts(), 8);
    EXPECT_NEAR(*error.mean(), 0, 1e-7);
}

// A "filter" that adds 1 in every even tile of four columns, on black: shifted by k = 1, 2, 3, the
// pattern of period 8 differs from itself in 2k of 8 columns. The compared 24 columns are three
// whole periods.
TEST(GridError, TilesShow) {
    for (int k = 1; k < 4; ++k) {
        const int width = 24 + k;
        const auto tiles = make_image(width, 6, [](int x, int) {
            const double v = x / 4 % 2;
            return Rgb{v, v, v};
        });
        GridError error(0);
        // On black, shift(I) = I, so F(shift(I)) = F(I) = tiles.
        ASSERT_TRUE(error.add(one(tiles), one(tiles), k, 0).ok());
        EXPECT_NEAR(*error.mean(), 2 * k / 8.0, 1e-9) << k;
    }
}

TEST(GridError, RefusesWhatLeavesNothing) {
    GridError error(10);
    const auto image = one(scene());
    EXPECT_EQ(error.add(image, image, 5, 0).code(), StatusCode::input);
    EXPECT_EQ(error.add(image, one(gray(3, 3, 0)), 0, 0).code(), StatusCode::input);
    EXPECT_FALSE(error.mean());
}

}  // namespace
}  // namespace postchain::metrics::temporal_test
