// Properties of FXAA, and the effect of each parameter's two ends.

#include <algorithm>
#include <cmath>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

const char* const kHints[] = {"none", "checkerboard", "threshold"};

ImageF color_noise(int width, int height, uint32_t seed, float low, float high) {
    return noise_image(width, height, 4, seed, low, high);
}

bool finite(const ImageF& image) {
    return std::all_of(image.data.begin(), image.data.end(),
                       [](float v) { return std::isfinite(v); });
}

TEST(Truth, NoEdgeAboveThresholdKeepsEveryBit) {
    // Display-referred: range <= 0.08 < 0.0833.
    const ImageF stored = color_noise(64, 48, 3, 0.02f, 0.0999f);
    EXPECT_TRUE(equal_bits(run(stored_settings(), stored), stored));
    // Bright: luma 0.8..0.95, range 0.15 < 0.166 * 0.95, but not 0.166 * 0.8.
    const ImageF bright = gray_image(64, 48, [](int x, int y) { return (x + y) % 2 ? 0.8 : 0.95; });
    EXPECT_TRUE(equal_bits(run(stored_settings(), bright), bright));
    EXPECT_FALSE(equal_bits(run(stored_settings({{"edge_threshold", 0.1}}), bright), bright));
    // Scene-linear: sqrt(v/(1+v)) of 1..1.3 is 0.707..0.752.
    const ImageF linear = color_noise(64, 48, 4, 1.0f, 1.3f);
    EXPECT_TRUE(equal_bits(run({{"hint", std::string("none")}}, linear), linear));
}

TEST(Truth, EqualLumaIsNoEdgeEvenWithoutThresholds) {
    // Red and green of the same luma: range 0 >= threshold 0, but there is no edge to follow.
    ImageF image(32, 24, 4, 0.0f);
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 32; ++x) image.at(x, y, (x / 3 + y / 2) % 2) = 1;
    const FramePlanes planes = planes_of(image, constant_hint(32, 24, 1, 1));
    FrameDescription frame = describe(planes);
    frame.luma_weights = {0.5, 0.5, 0};
    const Chain chain = fxaa_chain({{"hint", std::string("threshold")}});
    EXPECT_TRUE(equal_bits(filter(chain, frame, planes).at(Role::color), image));
}

TEST(Truth, PixelsBelowTheThresholdKeepEveryBitBesideEdges) {
    const ImageF step = gray_image(40, 24, [](int, int y) { return y < 12 ? 0.9 : 0.1; });
    ImageF image = step;
    const ImageF noise = color_noise(40, 24, 9, 0.0f, 0.03f);
    for (size_t i = 0; i < image.data.size(); ++i) image.data[i] += noise.data[i];
    const ImageF out = run(stored_settings(), image);
    int moved = 0;
    for (int y = 0; y < 24; ++y) {
        for (int x = 0; x < 40; ++x) {
            const bool same = std::equal(out.pixel(x, y), out.pixel(x, y) + 4, image.pixel(x, y));
            if (y != 11 && y != 12) {
                EXPECT_TRUE(same) << x << "," << y;
            }
            moved += !same;
        }
    }
    EXPECT_EQ(moved, 80);
}

TEST(Truth, NonFiniteHintsAreNone) {
    const ImageF image = color_noise(16, 16, 5, 0.0f, 1.0f);
    const ImageF plain = run({{"hint", std::string("none")}}, image);
    for (const char* hint : {"checkerboard", "threshold"}) {
        const SettingList settings = {{"hint", std::string(hint)}};
        for (const float none : {NAN, -1.0f, 0.0f, -INFINITY})
            EXPECT_TRUE(equal_bits(run(settings, image, constant_hint(16, 16, none, none)), plain));
        EXPECT_TRUE(equal_bits(run(settings, image, constant_hint(16, 16, INFINITY, 7)),
                               run(settings, image, constant_hint(16, 16, 1, 1))));
    }
}

// Each channel is between 0 and the minimum and maximum of the 3x3 neighborhood, up to a relative
// error of `rounding`.
void expect_finite_and_in_range(const char* mode, float rounding) {
    ImageF image = color_noise(48, 40, 8, -1.0f, 1.0f);
    const float sizes[] = {1e-38f, 1e-3f, 1, 65504, 1e30f, 3.4e38f};
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 48; ++x)
            for (int c = 0; c < 4; ++c) image.at(x, y, c) *= sizes[(x * 5 + y * 3 + c) % 6];
    for (const char* blend : {"stored", "tonemapped"}) {
        for (const double ev : {-32.0, 0.0, 32.0}) {
            const ImageF out = run(
                {{"mode", std::string(mode)}, {"blend", std::string(blend)}, {"exposure_ev", ev}},
                image, constant_hint(48, 40, 1, 1));
            ASSERT_TRUE(finite(out)) << blend << " " << ev;
            for (int y = 0; y < 40; ++y) {
                for (int x = 0; x < 48; ++x) {
                    for (int c = 0; c < 4; ++c) {
                        float low = 0, high = 0;
                        for (int j = -1; j <= 1; ++j) {
                            for (int i = -1; i <= 1; ++i) {
                                const float v =
                                    image.at(std::clamp(x + i, 0, 47), std::clamp(y + j, 0, 39), c);
                                low = std::min(low, v);
                                high = std::max(high, v);
                            }
                        }
                        EXPECT_GE(out.at(x, y, c), low + rounding * low);
                        EXPECT_LE(out.at(x, y, c), high + rounding * high);
                    }
                }
            }
        }
    }
}

TEST(Truth, FiniteInputsOfAnySizeStayFiniteAndInRange) {
    expect_finite_and_in_range("search", 0);
    expect_finite_and_in_range("directional", 1e-6f);
}

TEST(Truth, OnePixelAndOneLine) {
    const ImageF one = constant_image(1, 1, {0.2f, 0.9f, 3.0f, 0.5f});
    for (const char* hint : kHints)
        EXPECT_TRUE(
            equal_bits(run({{"hint", std::string(hint)}}, one, constant_hint(1, 1, 1, 1)), one));

    // One row 0 0 0 1 1 1: at the left of the border N = S = NE = ... follow the row, so it is an
    // endless vertical edge: H = 0.05041152 as in the 2-D case, from E.
    const ImageF row = gray_image(6, 1, [](int x, int) { return x < 3 ? 0 : 1; });
    const ImageF out = run(stored_settings(), row);
    EXPECT_NEAR(out.at(2, 0), 0.05041152, 1e-6);
    EXPECT_NEAR(out.at(3, 0), 0.94958848, 1e-6);
    EXPECT_EQ(out.at(1, 0), 0.0f);
    const ImageF column = gray_image(1, 6, [](int, int y) { return y < 3 ? 0 : 1; });
    const ImageF down = run(stored_settings(), column);
    EXPECT_NEAR(down.at(0, 2), 0.05041152, 1e-6);
    EXPECT_NEAR(down.at(0, 3), 0.94958848, 1e-6);
}

// Each luma is found once; edges read nine or thirteen of them, and the colors that they mix.
TEST(Truth, PlanCountsFetches) {
    const ImageF hint = constant_hint(17, 9, 1, 1);
    const uint64_t pixels = 17 * 9;
    auto fetches = [&](const SettingList& settings, const ImageF& given) {
        const FramePlanes planes = planes_of(constant_image(17, 9, {1, 1, 1, 1}), given);
        const auto plan = make_plan(fxaa_chain(settings), describe(planes), {.elide = false});
        EXPECT_TRUE(plan.ok() && plan->steps.size() == 2);
        EXPECT_EQ(plan->steps[0].taps, pixels);
        return plan->steps[1].taps / pixels;
    };
    EXPECT_EQ(fetches({}, {}), 9u + 2);
    EXPECT_EQ(fetches({}, hint), 9u + 2 + 1);
    EXPECT_EQ(fetches({{"hint", std::string("checkerboard")}}, hint), 9u + 3 + 1);
    EXPECT_EQ(fetches({{"mode", std::string("directional")}}, {}), 13u + 9);
    EXPECT_EQ(fetches({{"mode", std::string("directional")}}, hint), 13u + 9 + 1);
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
        const Chain chain = fxaa_chain({{"preset", preset}, {"blend", std::string("stored")}});
        const FramePlanes gpu = filter(chain, frame, planes);
        const ReferenceFrame cpu = reference(chain, frame, planes);
        const Difference difference =
            compare(gpu.at(Role::color), cpu.planes.at(Role::color), 2e-4);
        EXPECT_LE(difference.fraction, 0.03) << preset << ": " << difference.text;
    }
}

// Light of `value` on clear, with a slanted border.
ImageF on_clear(double value) {
    ImageF image = slanted_edge(64, 48, 0.37, 14.2, 0, 1, 1);
    for (size_t i = 0; i < image.pixels(); ++i) {
        image.data[4 * i + 3] = image.data[4 * i];
        for (size_t c = 0; c < 3; ++c) image.data[4 * i + c] *= float(value);
    }
    return image;
}

TEST(Truth, ColorAndAlphaStayTogether) {
    // If one color covers a pixel partly, color is alpha times it, so white on clear stays white
    // over white.
    for (const char* mode : {"search", "directional"}) {
        for (const char* blend : {"stored", "tonemapped"}) {
            for (const char* hint : kHints) {
                for (const double value : {0.2, 1.0, 5.0, 40.0}) {
                    const ImageF image = on_clear(value);
                    const ImageF out = run({{"mode", std::string(mode)},
                                            {"blend", std::string(blend)},
                                            {"hint", std::string(hint)}},
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
        const ImageF out = run({{"mode", std::string(mode)}}, aliased);
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

// ---- parameters ------------------------------------------------------------------------------

TEST(Parameter, EdgeThresholdEnds) {
    const ImageF gray = gray_image(16, 8, [](int, int y) { return y < 4 ? 0.9 : 0.6; });
    const SettingList all = stored_settings({{"edge_threshold", 0.0}});
    EXPECT_NE(run(all, gray).at(8, 3), 0.9f);
    EXPECT_EQ(run(stored_settings({{"edge_threshold", 1.0}}), gray).at(8, 3), 0.9f);
    // At 1 only full contrast, down to 0, is an edge.
    EXPECT_NE(run(stored_settings({{"edge_threshold", 1.0}}),
                  gray_image(16, 8, [](int, int y) { return y < 4 ? 0.9 : 0; }))
                  .at(8, 3),
              0.9f);
}

TEST(Parameter, ExposureEnds) {
    // A step of 40 to 20 becomes visible when exposed down (5 stops: 1.25 and 0.625); at either
    // end of the range everything is white or black.
    const ImageF high = gray_image(16, 8, [](int, int y) { return y < 4 ? 40 : 20; });
    EXPECT_NE(run({{"exposure_ev", -5.0}}, high).at(8, 3), 40.0f);
    EXPECT_EQ(run({{"exposure_ev", -32.0}}, high).at(8, 3), 40.0f);
    EXPECT_EQ(run({{"exposure_ev", 32.0}}, high).at(8, 3), 40.0f);
    // It also shapes the blend: the lower the exposure, the closer to the blend of stored values.

    const ImageF step = gray_image(16, 8, [](int, int y) { return y < 4 ? 3 : 0; });
    const SettingList stored_luma = {{"luma", std::string("stored")}};
    SettingList dark = stored_luma, bright = stored_luma;
    dark.push_back({"exposure_ev", -32.0});
    bright.push_back({"exposure_ev", 32.0});
    EXPECT_NEAR(run(dark, step).at(8, 4), 3 * 0.05041152, 1e-5);
    EXPECT_LT(run(bright, step).at(8, 4), 1e-5f);
}

TEST(Parameter, TableRefusesWhatIsOutOfRange) {
    const ParameterTable& table = *fxaa::pass_type().parameters;
    fxaa::Parameters parameters;
    const std::pair<const char*, ParameterValue> bad[] = {
        {"preset", int64_t(9)},       {"preset", int64_t(16)},  {"preset", int64_t(38)},
        {"preset", int64_t(40)},      {"subpix", -0.01},        {"subpix", 1.01},
        {"edge_threshold", -0.01},    {"edge_threshold", 1.01}, {"edge_threshold_min", -0.01},
        {"edge_threshold_min", 1.01}, {"exposure_ev", 33.0},    {"luma", "linear"},
        {"hint", "checker"}};
    for (const auto& [key, value] : bad)
        EXPECT_FALSE(table.set(&parameters, key, value).ok()) << key << " " << text_of(value);
    EXPECT_EQ(parameters.preset, 12);
    EXPECT_EQ(parameters.subpix, 0.75);
    EXPECT_EQ(thresholds(parameters).relative, 0.166);
    EXPECT_EQ(thresholds(parameters).least, 0.0833);
}

}  // namespace
}  // namespace postchain::test
