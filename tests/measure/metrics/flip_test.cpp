// FLIP and HDR-FLIP against the golden means of docs/metrics.md, from an independent program, and
// against closed forms of the paper.
#include "tools/measure/metrics/flip.h"

#include <cmath>
#include <limits>

#include "tests/measure/metrics/support.h"

namespace postchain::metrics {
namespace {

constexpr int kSide = 64;
constexpr double kGolden = 1e-4;
const Rgb kBlack = {0, 0, 0}, kWhiteRgb = {1, 1, 1};

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

double constants(const Rgb& reference, const Rgb& test) {
    return flip_of(constant(kSide, kSide, test), constant(kSide, kSide, reference)).mean;
}

TEST(FlipGolden, Constants) {
    EXPECT_NEAR(constants(kBlack, kWhiteRgb), 0.967388, kGolden);
    EXPECT_NEAR(constants({0, 1, 0}, {0, 0, 1}), 1.000000, kGolden);
    EXPECT_NEAR(constants({1, 0, 0}, {0, 1, 0}), 0.986665, kGolden);
    EXPECT_NEAR(constants({0.5, 0.5, 0.5}, {0.6, 0.6, 0.6}), 0.196255, kGolden);
    EXPECT_NEAR(constants({0.18, 0.18, 0.18}, {0.19, 0.19, 0.19}), 0.065048, kGolden);
}

TEST(FlipGolden, RampAgainstRampWithAnotherBlue) {
    const auto ramp = make_image(kSide, kSide, [](int x, int y) {
        return Rgb{x / 63.0, y / 63.0, (x + y) / 126.0};
    });
    const auto other = make_image(kSide, kSide, [](int x, int y) {
        return Rgb{x / 63.0, y / 63.0, 0.5};
    });
    const FlipResult result = flip_of(other, ramp);
    EXPECT_NEAR(result.mean, 0.330818, kGolden);
    EXPECT_NEAR(result.max, 0.808733, kGolden);
}

TEST(FlipGolden, ShiftedStep) {
    const auto step = [](int from) {
        return make_image(kSide, kSide, [=](int x, int) {
            const double v = x >= from ? 0.8 : 0.1;
            return Rgb{v, v, v};
        });
    };
    const FlipResult result = flip_of(step(33), step(32));
    EXPECT_NEAR(result.mean, 0.034444, kGolden);
    EXPECT_NEAR(result.max, 0.578762, kGolden);
}

TEST(FlipGolden, CheckerAgainstItsMean) {
    const auto checker = make_image(kSide, kSide, [](int x, int y) {
        const double v = (x + y) % 2;
        return Rgb{v, v, v};
    });
    const auto half = gray(kSide, kSide, 0.5);
    EXPECT_NEAR(flip_of(half, checker).mean, 0.004204, kGolden);
    FlipSettings near;
    near.pixels_per_degree = 20;
    EXPECT_NEAR(flip_of(half, checker, near).mean, 0.777964, kGolden);
}

TEST(HdrFlipGolden, Ramp) {
    const auto ramp = [](double gain) {
        return make_image(kSide, kSide, [=](int x, int y) {
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
        return make_image(kSide, kSide, [=](int x, int y) {
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
    const double wide = constants({0.5, 0.5, 0.5}, {0.6, 0.6, 0.6});
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
