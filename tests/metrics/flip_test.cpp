// FLIP and HDR-FLIP against golden means from an independent program, and against closed forms of
// the paper.
#include "tools/metrics/flip.h"

#include <cmath>
#include <limits>

#include "tests/metrics/support.h"

namespace postchain::metrics {
namespace {

constexpr int kSide = 64;
constexpr double kGolden = 1e-4;

Rgb scaled(double v, const Rgb& scale) {
    return {v * scale[0], v * scale[1], v * scale[2]};
}

FlipResult flip_of(const ImageF& test, const ImageF& reference, const FlipSettings& settings = {}) {
    return flip(pair(test, reference), settings);
}

FlipResult hdr_flip_of(const ImageF& test, const ImageF& reference,
                       ToneMapper mapper = ToneMapper::aces) {
    const Pair both = pair(test, reference);
    FlipSettings settings;
    settings.tone_mapper = mapper;
    return hdr_flip(both, exposure_range(both.reference, mapper), settings);
}

template <class F>
ImageF square(const F& f) {
    return make_image(kSide, kSide, f);
}

TEST(FlipGolden, ConstantsRampsStepsAndCheckers) {
    const auto flat = [](double r, double g, double b) {
        return square([=](int, int) { return Rgb{r, g, b}; });
    };
    const auto ramp = [](std::optional<double> blue) {
        return square([=](int x, int y) {
            return Rgb{x / 63.0, y / 63.0, blue.value_or((x + y) / 126.0)};
        });
    };
    const auto step = [](int from) {
        return square([=](int x, int) { return scaled(x >= from ? 0.8 : 0.1, {1, 1, 1}); });
    };
    const ImageF checker = square([](int x, int y) { return scaled((x + y) % 2, {1, 1, 1}); });
    struct Row {
        ImageF reference, test;
        double mean, max, pixels_per_degree = 67.02;
    };
    const Row rows[] = {{flat(0, 0, 0), flat(1, 1, 1), 0.967388, 0.967388},
                        {flat(0, 1, 0), flat(0, 0, 1), 1, 1},
                        {flat(1, 0, 0), flat(0, 1, 0), 0.986665, 0.986665},
                        {flat(0.5, 0.5, 0.5), flat(0.6, 0.6, 0.6), 0.196255, 0.196255},
                        {flat(0.18, 0.18, 0.18), flat(0.19, 0.19, 0.19), 0.065048, 0.065048},
                        {ramp({}), ramp(0.5), 0.330818, 0.808733},
                        {step(32), step(33), 0.034444, 0.578762},
                        {checker, flat(0.5, 0.5, 0.5), 0.004204, 1},
                        {checker, flat(0.5, 0.5, 0.5), 0.777964, 1, 20}};
    for (const Row& row : rows) {
        FlipSettings settings;
        settings.pixels_per_degree = row.pixels_per_degree;
        const FlipResult found = flip_of(row.test, row.reference, settings);
        EXPECT_NEAR(found.mean, row.mean, kGolden);
        if (row.max < 1) {
            EXPECT_NEAR(found.max, row.max, kGolden);
        }
    }
}

TEST(HdrFlipGolden, Ramp) {
    const auto ramp = [](double gain) {
        return square([=](int x, int y) {
            const double v = std::exp2(-4 + 10 * x / 63.0) * (y >= 32 ? gain : 1);
            return scaled(v, {1, 0.8, 0.6});
        });
    };
    const auto range = exposure_range(one(ramp(1)), ToneMapper::aces);
    EXPECT_NEAR(range.start, -4.6445, kGolden);
    EXPECT_NEAR(range.stop, 0.2761, kGolden);
    EXPECT_EQ(range.count(), 5);
    const FlipResult result = hdr_flip_of(ramp(1.1), ramp(1));
    EXPECT_NEAR(result.mean, 0.069130, kGolden);
    EXPECT_NEAR(result.max, 0.154359, kGolden);
}

TEST(HdrFlipGolden, MovedDiscWithEveryToneMapper) {
    const auto disc = [](double cx) {
        return square([=](int x, int y) {
            const double dx = x - cx, dy = y - 31.5;
            return scaled(dx * dx + dy * dy <= 100 ? 50 : 0.2 + 0.01 * y, {1, 0.8, 0.6});
        });
    };
    const auto reference = disc(31.5), test = disc(33.5);
    const auto range = exposure_range(one(reference), ToneMapper::aces);
    EXPECT_NEAR(range.start, -4.288401, 2e-6);
    EXPECT_NEAR(range.stop, 2.217952, 2e-6);
    EXPECT_EQ(range.count(), 7);
    EXPECT_NEAR(hdr_flip_of(test, reference, ToneMapper::aces).mean, 0.063121, kGolden);
    EXPECT_NEAR(hdr_flip_of(test, reference, ToneMapper::reinhard).mean, 0.064963, kGolden);
    EXPECT_NEAR(hdr_flip_of(test, reference, ToneMapper::hable).mean, 0.061302, kGolden);
}

TEST(Flip, EqualPicturesAreZeroAndOrderOfArgumentsDoesNotMatter) {
    const auto a = make_image(40, 30, [](int x, int y) {
        return Rgb{std::abs(std::sin(x * 1.7)), std::abs(std::sin(y * 0.9)), 0.3};
    });
    const auto b = make_image(40, 30, [](int x, int y) {
        return Rgb{std::abs(std::sin(x * 1.6)), 0.4, std::abs(std::cos(y * 0.7))};
    });
    EXPECT_EQ(flip_of(a, a).max, 0);
    EXPECT_EQ(flip_of(a, b).map, flip_of(b, a).map);
}

// A single pixel on black: FLIP's response is symmetric about it, largest there, and ends at the
// widest kernel's radius (10 pixels at 67.02 pixels per degree), also across bands of rows.
TEST(Flip, SinglePixelAnswersInItsNeighborhoodAlone) {
    for (const int cy : {20, 60}) {
        auto test = gray(41, 120, 0);
        for (int c = 0; c < 3; ++c) test.at(20, cy, c) = 1;
        const ImageF map = flip_of(test, gray(41, 120, 0)).map;
        for (int y = cy - 20; y < cy + 20; ++y)
            for (int x = 0; x < 41; ++x) {
                const int dx = x - 20, dy = y - cy;
                EXPECT_NEAR(map.at(x, y), map.at(20 - dx, y), 1e-5);
                EXPECT_NEAR(map.at(x, y), map.at(20 + dy, cy + dx), 1e-5);
                EXPECT_LE(map.at(x, y), map.at(20, cy) + 1e-6);
                if (std::abs(dx) > 10 || std::abs(dy) > 10) {
                    EXPECT_EQ(map.at(x, y), 0);
                }
            }
        EXPECT_GT(map.at(20, cy), 0.5);
        EXPECT_GT(map.at(23, cy), 0);
    }
}

TEST(Flip, ThreadsDoNotShow) {
    const auto a = make_image(50, 200, [](int x, int y) {
        return Rgb{std::abs(std::sin(x * 1.7 + y)), std::abs(std::sin(y * 0.9)), 5.0};
    });
    const auto b = gray(50, 200, 0.4);
    FlipSettings one_thread, four_threads;
    one_thread.threads = 1;
    four_threads.threads = 4;
    const Pair both = pair(a, b);
    const auto range = exposure_range(both.reference, ToneMapper::aces);
    EXPECT_EQ(hdr_flip(both, range, one_thread).map, hdr_flip(both, range, four_threads).map);
}

TEST(Flip, OnePixel) {
    const double wide = flip_of(gray(9, 9, 0.6), gray(9, 9, 0.5)).mean;
    const FlipResult result = flip_of(gray(1, 1, 0.6), gray(1, 1, 0.5));
    EXPECT_NEAR(result.mean, wide, 1e-5);
    EXPECT_EQ(result.map.pixels(), 1u);
    EXPECT_NEAR(hdr_flip_of(gray(1, 1, 0.6), gray(1, 1, 0.5)).mean,
                hdr_flip_of(gray(9, 9, 0.6), gray(9, 9, 0.5)).mean, 1e-5);
}

TEST(Flip, ValuesBeyondTheDisplayAreClamped) {
    EXPECT_EQ(flip_of(gray(4, 4, 7), gray(4, 4, 1)).mean, 0);
    EXPECT_EQ(flip_of(gray(4, 4, -7), gray(4, 4, 0)).mean, 0);
}

TEST(HdrFlip, BlackReferenceHasNoExposuresAndAnAnswer) {
    const auto range = exposure_range(one(gray(8, 8, 0)), ToneMapper::aces);
    EXPECT_FALSE(range.lit);
    EXPECT_EQ(hdr_flip_of(gray(8, 8, 0), gray(8, 8, 0)).mean, 0);
    const double lit = hdr_flip_of(gray(8, 8, 1), gray(8, 8, 0)).mean;
    EXPECT_GT(lit, 0.5);
    EXPECT_LE(lit, 1);
}

TEST(HdrFlip, InfAndHugeValuesStayInRange) {
    auto reference = gray(16, 16, 0.3);
    reference.at(3, 3, 0) = std::numeric_limits<float>::infinity();
    reference.at(5, 5, 1) = std::numeric_limits<float>::quiet_NaN();
    reference.at(8, 8, 2) = std::numeric_limits<float>::max();
    auto test = gray(16, 16, 0.4);
    test.at(9, 9, 0) = -std::numeric_limits<float>::max();
    test.at(10, 9, 0) = std::numeric_limits<float>::infinity();
    for (ToneMapper mapper : {ToneMapper::aces, ToneMapper::reinhard, ToneMapper::hable}) {
        const FlipResult result = hdr_flip_of(test, reference, mapper);
        for (float v : result.map.data) ASSERT_TRUE(v >= 0 && v <= 1) << v;
        EXPECT_GT(result.mean, 0);
    }
    EXPECT_EQ(hdr_flip_of(reference, reference).max, 0);
}

}  // namespace
}  // namespace postchain::metrics
