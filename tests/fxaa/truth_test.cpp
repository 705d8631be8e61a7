// Properties of FXAA.

#include <algorithm>
#include <cmath>

#include "tests/fxaa/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

bool finite(const ImageF& image) {
    return std::all_of(image.data.begin(), image.data.end(),
                       [](float v) { return std::isfinite(v); });
}

// A border between two grays, of which the brighter one changes or keeps its value.
TEST(Threshold, IsOfTheBrighterLumaTheModeAndTheExposure) {
    const SettingList stored = stored_settings(), directional = {{"mode", "directional"}};
    const struct {
        const char* name;
        SettingList settings;
        double bright, dark;
        bool changes;
    } rows[] = {
        {"a range of 0.08, below 0.0833", stored, 0.1, 0.02, false},
        {"0.15 is below 0.166 of 0.95, but not of 0.8", stored, 0.95, 0.8, false},
        {"a lower threshold", stored_settings({{"edge_threshold", 0.1}}), 0.95, 0.8, true},
        {"none", stored_settings({{"edge_threshold", 0.0}}), 0.9, 0.6, true},
        {"only full contrast", stored_settings({{"edge_threshold", 1.0}}), 0.9, 0.6, false},
        {"full contrast", stored_settings({{"edge_threshold", 1.0}}), 0.9, 0, true},
        {"0.06 in mode search", stored, 0.8, 0.74, false},
        // Above max(0.0312, 0.063 * 0.8 = 0.0504).
        {"0.06 in mode directional", stored_settings(directional), 0.8, 0.74, true},
        {"a threshold of the chain",
         stored_settings({{"mode", "directional"}, {"edge_threshold", 0.1}}), 0.8, 0.74, false},
        // sqrt(v/(1+v)) is 0.707 and 0.752, 0.976 and 0.988.
        {"scene-linear", {}, 1.3, 1, false},
        {"too bright to differ", {}, 40, 20, false},
        {"1.25 and 0.625", {{"exposure_ev", -5.0}}, 40, 20, true},
        {"all black", {{"exposure_ev", -32.0}}, 40, 20, false},
        {"all white", {{"exposure_ev", 32.0}}, 40, 20, false}};
    for (const auto& [name, settings, bright, dark, changes] : rows) {
        const ImageF image = border(bright, dark);
        EXPECT_EQ(equal_bits(run(settings, image), image), !changes) << name;
    }
}

TEST(Truth, EqualLumaIsNoEdgeEvenWithoutThresholds) {
    // Red and green of the same luma: range 0 >= threshold 0, but there is no edge to follow.
    ImageF image(32, 24, 4, 0.0f);
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 32; ++x) image.at(x, y, (x / 3 + y / 2) % 2) = 1;
    const FramePlanes planes = planes_of(image, constant_hint(32, 24, 1, 1));
    FrameDescription frame = describe(planes);
    frame.luma_weights = {0.5, 0.5, 0};
    const Chain chain = fxaa_chain({{"hint", "threshold"}});
    EXPECT_TRUE(equal_bits(filter(chain, frame, planes).at(Role::color), image));
}

TEST(Truth, NonFiniteHintsAreNone) {
    const ImageF image = noise_image(16, 16, 4, 5, 0.0f, 1.0f);
    const ImageF plain = run({{"hint", "none"}}, image);
    for (const char* hint : {"checkerboard", "threshold"}) {
        const SettingList settings = {{"hint", hint}};
        for (const float none : {NAN, -1.0f, 0.0f, -INFINITY})
            EXPECT_TRUE(equal_bits(run(settings, image, constant_hint(16, 16, none, none)), plain));
        EXPECT_TRUE(equal_bits(run(settings, image, constant_hint(16, 16, INFINITY, 7)),
                               run(settings, image, constant_hint(16, 16, 1, 1))));
    }
}

// Each channel is between 0 and the minimum and maximum of the 3x3 neighborhood. Weights of
// `directional` add to 1 up to rounding.
TEST(Truth, FiniteInputsOfAnySizeStayFiniteAndInRange) {
    ImageF image = noise_image(48, 40, 4, 8, -1.0f, 1.0f);
    const float sizes[] = {1e-38f, 1e-3f, 1, 65504, 1e30f, 3.4e38f};
    for (size_t i = 0; i < image.data.size(); ++i) image.data[i] *= sizes[i * 5 / 4 % 6];
    const auto expect_range = [&](const ImageF& out, int x, int y, int c, float rounding) {
        float low = 0, high = 0;
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
                const float v = image.at(std::clamp(x + i, 0, 47), std::clamp(y + j, 0, 39), c);
                low = std::min(low, v);
                high = std::max(high, v);
            }
        EXPECT_GE(out.at(x, y, c), low + rounding * low);
        EXPECT_LE(out.at(x, y, c), high + rounding * high);
    };
    for (const auto& [mode, rounding] : {std::pair{"search", 0.0f}, {"directional", 1e-6f}})
        for (const char* blend : {"stored", "tonemapped"})
            for (const double ev : {-32.0, 0.0, 32.0}) {
                SCOPED_TRACE(concat(mode, " ", blend, " ", ev));
                const ImageF out = run({{"mode", mode}, {"blend", blend}, {"exposure_ev", ev}},
                                       image, constant_hint(48, 40, 1, 1));
                ASSERT_TRUE(finite(out));
                for (int y = 0; y < 40; ++y)
                    for (int x = 0; x < 48; ++x)
                        for (int c = 0; c < 4; ++c) expect_range(out, x, y, c, rounding);
            }
}

// Each luma is found once; edges read nine or thirteen of them, and the colors that they mix.
TEST(Truth, PlanCountsFetches) {
    const ImageF hint = constant_hint(17, 9, 1, 1);
    const uint64_t pixels = 17 * 9;
    auto fetches = [&](const SettingList& settings, const ImageF& given) {
        const FramePlanes planes = planes_of(constant_image(17, 9, {1, 1, 1, 1}), given);
        const Plan plan = must(make_plan(fxaa_chain(settings), describe(planes), {.elide = false}));
        EXPECT_EQ(plan.steps.at(0).taps, pixels);
        return plan.steps.at(1).taps / pixels;
    };
    EXPECT_EQ(fetches({}, {}), 9u + 2);
    EXPECT_EQ(fetches({}, hint), 9u + 2 + 1);
    EXPECT_EQ(fetches({{"hint", "checkerboard"}}, hint), 9u + 3 + 1);
    EXPECT_EQ(fetches({{"mode", "directional"}}, {}), 13u + 9);
    EXPECT_EQ(fetches({{"mode", "directional"}}, hint), 13u + 9 + 1);
}

TEST(Truth, ExactTiesFollowTheStatedOrder) {
    // Black and 1e30 from a hash: the display luma is exactly 0 or 1 (weights 1/4, 1/2, 1/4), so
    // that scores, gradients and ends tie everywhere and fp32 and double both see it.
    const ImageF pattern = gray_image(128, 96, [](int x, int y) {
        return ((x * 73856093u) ^ (y * 19349663u) ^ ((x * y) * 83492791u)) >> 13 & 1u ? 1e30 : 0;
    });
    const FramePlanes planes = planes_of(pattern);
    FrameDescription frame = describe(planes);
    frame.luma_weights = {0.25, 0.5, 0.25};
    for (const int64_t preset : fxaa::presets()) {
        const Chain chain = fxaa_chain({{"preset", preset}, {"blend", "stored"}});
        const FramePlanes gpu = filter(chain, frame, planes);
        const ReferenceFrame cpu = reference(chain, frame, planes);
        const Difference difference =
            compare(gpu.at(Role::color), cpu.planes.at(Role::color), 2e-4);
        EXPECT_LE(difference.fraction, 0.03) << preset << ": " << difference.text;
    }
}

// Light of `value` on clear, with a slanted border.
ImageF on_clear(double value, double slope = 0.37, int samples = 1) {
    ImageF image = slanted_edge(64, 48, slope, 4.2, 0, 1, samples);
    for (size_t i = 0; i < image.pixels(); ++i) {
        image.data[4 * i + 3] = image.data[4 * i];
        for (size_t c = 0; c < 3; ++c) image.data[4 * i + c] *= float(value);
    }
    return image;
}

// Against sixteen times sixteen samples a pixel.
TEST(Truth, BlackOnClearLosesItsStairs) {
    for (const double slope : {0.37, 0.8}) {
        const ImageF aliased = on_clear(0, slope), truth = on_clear(0, slope, 16);
        const auto squares = [&](const ImageF& image) {
            double sum = 0;
            for (size_t i = 3; i < image.data.size(); i += 4)
                sum += std::pow(double(image.data[i] - truth.data[i]), 2);
            return sum;
        };
        for (const char* luma : {"stored", "display"})
            for (const char* mode : {"search", "directional"})
                EXPECT_LT(squares(run({{"mode", mode}, {"luma", luma}}, aliased)),
                          0.5 * squares(aliased))
                    << mode << " " << luma << " " << slope;
    }
}

// An alpha that is the same everywhere, as of frames that have none, changes no decision but ties
// between scores.
TEST(Truth, ConstantAlphaIsNoEdge) {
    ImageF opaque = noise_image(48, 40, 4, 6, 0.0f, 0.25f), clear = opaque;
    for (size_t i = 0; i < opaque.pixels(); ++i) {
        opaque.data[4 * i + 3] = 1;
        clear.data[4 * i + 3] = 0;
    }
    for (const char* mode : {"search", "directional"}) {
        const ImageF a = run({{"mode", mode}}, opaque), b = run({{"mode", mode}}, clear);
        size_t other = 0;
        for (size_t i = 0; i < a.pixels(); ++i)
            other += std::abs(a.data[4 * i] - b.data[4 * i]) > 1e-5f;
        EXPECT_LE(other, mode == std::string("search") ? a.pixels() / 30 : 0) << mode;
    }
}

TEST(Truth, NegativeInfinityStaysWhereItIs) {
    ImageF image = constant_image(15, 13, {0.5f, 0.5f, 0.5f, 1});
    image.at(7, 6, 1) = -INFINITY;
    for (const char* mode : {"search", "directional"})
        for (const char* blend : {"stored", "tonemapped"})
            for (const char* luma : {"stored", "display"}) {
                const ImageF out = run({{"mode", mode}, {"blend", blend}, {"luma", luma}}, image);
                ASSERT_TRUE(finite(out));
                for (int y = 0; y < 13; ++y)
                    for (int x = 0; x < 15; ++x)
                        if (x != 7 || y != 6) {
                            ASSERT_NEAR(out.at(x, y, 1), 0.5, 1e-6)
                                << mode << " " << blend << " " << luma << " " << x << "," << y;
                        }
            }
}

TEST(Truth, ColorAndAlphaStayTogether) {
    // If one color covers a pixel partly, color is alpha times it, so white on clear stays white
    // over white.
    for (const char* mode : {"search", "directional"}) {
        for (const char* blend : {"stored", "tonemapped"}) {
            for (const char* hint : {"none", "checkerboard", "threshold"}) {
                for (const double value : {0.2, 40.0}) {
                    const ImageF image = on_clear(value);
                    const ImageF out = run({{"mode", mode}, {"blend", blend}, {"hint", hint}},
                                           image, constant_hint(64, 48, 0.6f, 0.6f));
                    EXPECT_FALSE(equal_bits(out, image));
                    for (size_t i = 0; i < out.pixels(); ++i)
                        for (size_t c = 0; c < 3; ++c)
                            ASSERT_NEAR(out.data[4 * i + c], value * double(out.data[4 * i + 3]),
                                        1e-5 * value)
                                << mode << " " << blend << " " << hint << " " << value;
                }
            }
        }
    }
}

TEST(Truth, NoSeamBetweenHues) {
    // Luminance 7.9 beside 5.2, the largest channels different ones.
    const double red[3] = {7.9 / 0.2126, 0, 0}, green[3] = {0, 5.2 / 0.7152, 0};
    const auto seam = [&](int samples) {
        ImageF image = slanted_edge(96, 72, 0.37, 14.2, 0, 1, samples);
        for (size_t i = 0; i < image.pixels(); ++i) {
            const double share = double(image.data[4 * i]);
            for (size_t c = 0; c < 3; ++c)
                image.data[4 * i + c] = float(red[c] * share + green[c] * (1 - share));
        }
        return image;
    };
    const auto luminance = [](const ImageF& image, size_t i) {
        return 0.2126 * double(image.data[4 * i]) + 0.7152 * double(image.data[4 * i + 1]);
    };
    const ImageF truth = seam(16), aliased = seam(1);
    for (const char* mode : {"search", "directional"}) {
        const ImageF out = run({{"mode", mode}}, aliased);
        double filtered = 0, unfiltered = 0;
        for (size_t i = 0; i < out.pixels(); ++i) {
            EXPECT_GE(luminance(out, i), 5.2 - 1e-4) << mode;
            EXPECT_LE(luminance(out, i), 7.9 + 1e-4) << mode;
            filtered += std::pow(luminance(out, i) - luminance(truth, i), 2);
            unfiltered += std::pow(luminance(aliased, i) - luminance(truth, i), 2);
        }
        EXPECT_LT(filtered, 0.5 * unfiltered) << mode;
    }
}

}  // namespace
}  // namespace postchain::test
