#include "tools/metrics/temporal.h"

#include <cmath>
#include <string>

#include "tests/metrics/support.h"

namespace postchain::metrics::temporal_test {
namespace {

std::optional<double> last(const TemporalError& error, const std::string& name = "temporal_error") {
    for (const auto& [metric, value] : error.last())
        if (metric == name) return value;
    ADD_FAILURE() << name;
    return std::nullopt;
}

// A constant error does not count, however large; one that grows by 0.25 per frame does.
TEST(TemporalError, LinearChangeOfTheErrorAlone) {
    TemporalError still, growing;
    for (int t = 0; t < 4; ++t) {
        const auto truth = gray(5, 4, 0.1 * t);
        ASSERT_TRUE(still.add(pair(gray(5, 4, 0.1 * t + 3), truth)).ok());
        ASSERT_TRUE(growing.add(pair(gray(5, 4, 0.1 * t + 0.25 * t), truth)).ok());
    }
    EXPECT_NEAR(*last(still, "tde"), 0, 1e-6);
    EXPECT_NEAR(*last(growing, "tde"), 0.25, 1e-6);
}

// A single pixel of 4 x 5 that is too bright by 2 in the middle frame of three: it appears and
// disappears, each time 2/20 in the mean.
TEST(TemporalError, LinearChangeOfASinglePixel) {
    TemporalError error;
    auto test = gray(4, 5, 1);
    const auto truth = gray(4, 5, 1);
    ASSERT_TRUE(error.add(pair(test, truth)).ok());
    EXPECT_FALSE(last(error, "tde"));
    EXPECT_FALSE(last(error));
    for (int c = 0; c < 3; ++c) test.at(2, 2, c) = 3;
    for (const auto& image : {test, truth}) {
        ASSERT_TRUE(error.add(pair(image, truth)).ok());
        EXPECT_NEAR(*last(error, "tde"), 0.1, 1e-9);
    }
}

// Displayed values: the ground truth rises from 0.25 by 0.125 a frame, and what is shown is
// `error(t)` above it.
template <class F>
double error_of(const F& error) {
    TemporalError temporal;
    for (int t = 0; t < 3; ++t) {
        const double truth = 0.25 + 0.125 * t;
        const auto shown = gray(4, 3, shown_as(truth + error(t)));
        EXPECT_TRUE(temporal.add(pair(shown, gray(4, 3, shown_as(truth)))).ok());
    }
    return *last(temporal);
}

TEST(TemporalError, IsTheChangeOfTheErrorOverThatOfTheTruth) {
    EXPECT_NEAR(error_of([](int) { return 0.125; }), 0, 1e-6);
    EXPECT_NEAR(error_of([](int t) { return 0.125 * t; }), 1, 1e-5);
    EXPECT_NEAR(error_of([](int t) { return -0.125 * t; }), 1, 1e-5);  // it stands still
    EXPECT_NEAR(error_of([](int t) { return t % 2 * 0.03125; }), 0.25, 1e-5);
}

// Only one of four pixels changes: the truth by 0.2 and the error by 0.1, both rms over all four.
TEST(TemporalError, IsARatioOfRootMeanSquares) {
    TemporalError error;
    ImageF test = gray(4, 1, shown_as(0.3)), truth = test;
    ASSERT_TRUE(error.add(pair(test, truth)).ok());
    for (int c = 0; c < 3; ++c) {
        truth.at(1, 0, c) = float(shown_as(0.5));
        test.at(1, 0, c) = float(shown_as(0.5));
        test.at(2, 0, c) = float(shown_as(0.4));
    }
    ASSERT_TRUE(error.add(pair(test, truth)).ok());
    EXPECT_NEAR(*last(error), 0.5, 1e-5);
}

// Where the ground truth stands still, the unit is a step of an 8-bit display.
TEST(TemporalError, CountsInStepsOfTheDisplayOverAStillTruth) {
    TemporalError error;
    const auto truth = gray(4, 4, shown_as(0.5));
    ASSERT_TRUE(error.add(pair(truth, truth)).ok());
    ASSERT_TRUE(error.add(pair(gray(4, 4, shown_as(0.5 + 3.0 / 255)), truth)).ok());
    EXPECT_NEAR(*last(error), 3, 1e-3);
}

// Four pixels, one of each class in the frame that is added; the error of one alone changes.
TEST(TemporalError, IsMeasuredApartInEachClass) {
    using enum PixelClass;
    for (size_t changed = 0; changed < kPixelClasses; ++changed) {
        TemporalError error;
        Image<PixelClass> classes(4, 1, 1);
        classes.data = {still, moving, defocused, outline};
        const ImageF before = gray(4, 1, shown_as(0.25)), truth = gray(4, 1, shown_as(0.5));
        ImageF test = truth;
        for (int c = 0; c < 3; ++c) test.at(int(changed), 0, c) = float(shown_as(0.75));
        ASSERT_TRUE(error.add(pair(before, before), classes).ok());
        ASSERT_TRUE(error.add(pair(test, truth), classes).ok());
        for (size_t i = 0; i < kPixelClasses; ++i)
            EXPECT_NEAR(*last(error, temporal_class_rows()[i].name), i == changed, 1e-5);
        EXPECT_NEAR(*last(error), 0.5, 1e-5);
    }
}

// A pixel that moves in one of the two frames is not still, and no class has a value without
// pixels.
TEST(TemporalError, TakesTheClassOfEitherFrame) {
    for (const bool first : {true, false}) {
        TemporalError error;
        const ImageF image = gray(3, 2, 1);
        for (const bool second : {false, true})
            ASSERT_TRUE(
                error
                    .add(pair(image, image),
                         Image<PixelClass>(
                             3, 2, 1, first == second ? PixelClass::still : PixelClass::moving))
                    .ok());
        EXPECT_FALSE(last(error, "temporal_error_still"));
        EXPECT_EQ(last(error, "temporal_error_moving"), 0);
        // The classes of the frame before count, not those of an earlier one.
        for (int i = 0; i < 2; ++i)
            ASSERT_TRUE(
                error.add(pair(image, image), Image<PixelClass>(3, 2, 1, PixelClass::still)).ok());
        EXPECT_EQ(last(error, "temporal_error_still"), 0);
        EXPECT_FALSE(last(error, "temporal_error_moving"));
    }
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
    // Only the height differs, only the width, both.
    for (const auto& [width, height] : {std::pair(4, 5), {5, 4}, {5, 5}})
        EXPECT_EQ(error.add(pair(gray(width, height, 0), gray(width, height, 0))).code(),
                  StatusCode::input);
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
    GridError all(0);
    for (const bool rows : {false, true})
        for (int k = 1; k < 4; ++k) {
            const int side = 24 + k;
            const auto tiles = make_image(rows ? 6 : side, rows ? side : 6, [=](int x, int y) {
                const double v = (rows ? y : x) / 4 % 2;
                return Rgb{v, v, v};
            });
            GridError error(0);
            // On black, shift(I) = I, so F(shift(I)) = F(I) = tiles.
            for (GridError* to : {&error, &all})
                ASSERT_TRUE(to->add(one(tiles), one(tiles), rows ? 0 : k, rows ? k : 0).ok());
            EXPECT_NEAR(*error.mean(), 2 * k / 8.0, 1e-9) << k;
        }
    EXPECT_EQ(all.shifts(), 6);
    EXPECT_NEAR(*all.mean(), 0.5, 1e-9);
}

TEST(GridError, RefusesWhatLeavesNothing) {
    GridError error(10);
    const auto image = one(scene());
    EXPECT_EQ(error.add(image, image, 5, 0).code(), StatusCode::input);
    EXPECT_EQ(error.add(one(gray(40, 20, 0)), one(gray(40, 20, 0)), 0, 5).code(),
              StatusCode::input);
    EXPECT_EQ(error.add(image, one(gray(3, 3, 0)), 0, 0).code(), StatusCode::input);
    EXPECT_FALSE(error.mean());
}

}  // namespace
}  // namespace postchain::metrics::temporal_test
