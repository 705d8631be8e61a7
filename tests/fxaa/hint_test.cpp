// The hint: the report's checkerboard simulated literally, and the effect of each choice.

#include <array>
#include <cmath>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

SettingList hinted(const char* hint, const char* gate = "tile") {
    return {{"luma", "stored"}, {"blend", "stored"}, {"hint", hint}, {"hint_gate", gate}};
}

// Edges that end where the last steps of a search lead; each channel of a hint, and each use of it.
TEST(Reference, OfLongEdgesAndHints) {
    const ImageF hint = noise_image(101, 67, 2, 5, -0.2f, 1.2f);
    for (const bool steep : {false, true})
        for (const double slope : {1.0 / 7, 1.0 / 13, 1.0 / 40})
            for (const char* kind : {"none", "checkerboard", "threshold"})
                for (const char* gate : {"tile", "pixel"})
                    for (const char* where : {"everywhere", "blurred"}) {
                        SCOPED_TRACE(concat(steep, " ", slope, " ", kind, " ", gate, " ", where));
                        SettingList settings = hinted(kind, gate);
                        settings.push_back({"where", where});
                        settings.push_back({"preset", int64_t(steep ? 10 : 29)});
                        const double light = kind == "threshold"s ? 0.27 : 0.9;
                        const ImageF color = gray_image(101, 67, [&](int x, int y) {
                            return (steep ? x > 40 + slope * y : y > 30 + slope * x) ? light : 0.2;
                        });
                        const fxaa::Parameters parameters = parameters_of(settings);
                        const ImageD colors = image_cast<double>(color),
                                     hints = image_cast<double>(hint);
                        const ImageD expected = fxaa::reference_fxaa(
                            parameters, colors, fxaa::reference_luma(parameters, colors, {}),
                            &hints);
                        const Difference difference =
                            compare(run(settings, color, hint), expected, 1e-4);
                        // 3 % are at the edge; ends of a search may be ties.
                        EXPECT_LE(difference.fraction, 0.006) << difference.text;
                    }
}

TEST(Checkerboard, LiteralLumaEqualsTheShortCut) {
    // By hand, M = m in {0, 1}: N = S = E = W = 1 - m, corners m. Range 1 >= any threshold. Scores
    // 2|2(1-m) - 2m| + 2 |2m - 2(1-m)| = 8 both ways: horizontal. Gradients 1 and 1: N. Pair mean
    // 0.5. A = (8(1-m) + 4m)/12 - m = 2/3 - 4m/3, |A| = 2/3, t = 2/3, F = 4/9 (3 - 4/3) = 20/27,
    // H = 400/729 subpix = 0.5487 subpix. On the line every luma is 0.5: no end, the whole search,
    // equal distances, edge offset 0. So: N with weight H, whatever m.
    const ImageF color = noise_image(80, 60, 4, 11);
    ImageD checkers(80, 60, 1);
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 80; ++x) checkers.at(x, y) = (x + y) & 1;
    for (const int64_t preset : fxaa::presets()) {
        for (const double subpix : {0.0, 0.75, 1.0}) {
            SettingList settings = hinted("checkerboard");
            settings.push_back({"preset", preset});
            settings.push_back({"subpix", subpix});
            const ImageD literal = fxaa::reference_fxaa(
                parameters_of(settings), image_cast<double>(color), checkers, nullptr);
            const ImageF gpu = run(settings, color, constant_hint(80, 60, 1, 0));
            const double k = 400.0 / 729 * subpix;
            // The upper neighbor of row 0 is row 0 itself.
            for (int i = 0; i < 4 * 80; ++i) EXPECT_EQ(gpu.data[size_t(i)], color.data[size_t(i)]);
            for (int y = 1; y < 59; ++y) {
                for (int x = 0; x < 80; ++x) {
                    for (int c = 0; c < 4; ++c) {
                        EXPECT_NEAR(gpu.at(x, y, c), literal.at(x, y, c), 1e-6);
                        EXPECT_NEAR(gpu.at(x, y, c),
                                    (1 - k) * color.at(x, y, c) + k * color.at(x, y - 1, c), 1e-6);
                    }
                }
            }
        }
    }
}

// A row of 1e9 below and above black; k is the weight of the pixel above. In the mean of a black
// one the row counts 1/sqrt(1 + 1e9) = 3.2e-5, in its own mean both count the same.
TEST(Checkerboard, BrightRowUnderBlackKeepsItsDigits) {
    const ImageF color = gray_image(20, 10, [](int, int y) { return y == 5 ? 1e9 : 0.0; });
    const ImageF out =
        run({{"luma", "stored"}, {"hint", "checkerboard"}}, color, constant_hint(20, 10, 1, 1));
    const double k = 400.0 / 729 * 0.75, counts = 1 / std::sqrt(1 + 1e9);
    for (int x = 0; x < 20; ++x) {
        EXPECT_NEAR(out.at(x, 5) / (1e9 * (1 - k)), 1, 1e-5);
        // Black under the bright row.
        const double under = counts * k / (counts * k + 1 - k);
        EXPECT_NEAR(out.at(x, 6) / (1e9 * under), 1, 1e-5);
    }
}

TEST(Checkerboard, AFractionalHintLiesBetweenPlainAndTwoTaps) {
    const ImageF color = noise_image(48, 32, 4, 13);
    const ImageF plain = run(hinted("none"), color);
    const ImageF taps = run(hinted("checkerboard"), color, constant_hint(48, 32, 1, 1));
    for (const float h : {0.25f, 0.5f, 0.9f}) {
        const ImageF out = run(hinted("checkerboard"), color, constant_hint(48, 32, h, 0));
        for (size_t i = 0; i < out.data.size(); ++i)
            EXPECT_NEAR(out.data[i], (1 - h) * plain.data[i] + h * taps.data[i], 1e-6);
    }
    EXPECT_TRUE(equal_bits(run(hinted("checkerboard"), color, constant_hint(48, 32, 0, 1)), plain));
}

TEST(Threshold, AHintScalesBothThresholds) {
    const ImageF color = noise_image(48, 32, 4, 15, 0.3f, 0.5f);
    for (const double h : {0.5, 1.0}) {
        SettingList scaled = hinted("none");
        scaled.push_back({"edge_threshold", (1 - h) * 0.166});
        scaled.push_back({"edge_threshold_min", (1 - h) * 0.0833});
        const ImageF expected = run(scaled, color);
        EXPECT_TRUE(equal_bits(run(hinted("threshold"), color, constant_hint(48, 32, float(h), 0)),
                               expected));
        EXPECT_FALSE(equal_bits(run(hinted("none"), color), expected));
    }
}

TEST(Hint, TheGateChoosesTheChannel) {
    const ImageF color = noise_image(48, 32, 4, 16, 0.4f, 0.6f);
    const ImageF plain = run(hinted("none"), color);
    const ImageF tile_only = constant_hint(48, 32, 1, 0), pixel_only = constant_hint(48, 32, 0, 1);
    for (const char* hint : {"checkerboard", "threshold"}) {
        const ImageF with = run(hinted(hint, "tile"), color, tile_only);
        EXPECT_FALSE(equal_bits(with, plain));
        EXPECT_TRUE(equal_bits(run(hinted(hint, "pixel"), color, pixel_only), with));
        EXPECT_TRUE(equal_bits(run(hinted(hint, "pixel"), color, tile_only), plain));
        EXPECT_TRUE(equal_bits(run(hinted(hint, "tile"), color, pixel_only), plain));
        EXPECT_TRUE(equal_bits(run(hinted(hint), color), plain)) << "without a plane";
    }
    EXPECT_TRUE(equal_bits(run(hinted("none"), color, constant_hint(48, 32, 1, 1)), plain));
}

// A gate h of the pixel mixes in h of what FXAA makes of it. Without a hint the pixel keeps its
// bits.
TEST(Hint, WhereBlurredMixesByTheGate) {
    const ImageF color = noise_image(48, 32, 4, 17, 0.2f, 0.8f);
    ImageF gates = constant_hint(48, 32, 1, 0);
    for (int y = 5; y < 30; ++y)
        for (int x = 9; x < 44; ++x) gates.at(x, y, 1) = std::array{NAN, 0.25f, 0.75f, 3.0f}[x % 4];
    for (const char* mode : {"search", "directional"})
        for (const char* hint : {"none", "checkerboard", "threshold"}) {
            SCOPED_TRACE(concat(mode, " ", hint));
            SettingList settings = hinted(hint, "pixel");
            settings.push_back({"mode", std::string(mode)});
            const ImageF everywhere =  // both thresholds are 0 inside the gate
                run(settings, color, hint == "threshold"s ? constant_hint(48, 32, 1, 1) : gates);
            settings.push_back({"where", std::string("blurred")});
            const ImageF out = run(settings, color, gates);
            EXPECT_FALSE(equal_bits(out, color));
            const fxaa::Parameters parameters = parameters_of(settings);
            const ImageD wide = image_cast<double>(color), hints = image_cast<double>(gates);
            const ImageD reference = fxaa::reference_fxaa(
                parameters, wide, fxaa::reference_luma(parameters, wide, {}), &hints);
            for (int y = 0; y < 32; ++y)
                for (int x = 0; x < 48; ++x)
                    for (int c = 0; c < 4; ++c) {
                        const float gate = gates.at(x, y, 1), own = color.at(x, y, c);
                        const double h = gate > 0 ? std::min(gate, 1.0f) : 0;
                        const double mixed = own + h * (everywhere.at(x, y, c) - own);
                        ASSERT_NEAR(out.at(x, y, c), mixed, h == 0 ? 0 : 1e-6) << x << "," << y;
                        if (parameters.mode == fxaa::Mode::directional) {  // the search has ties
                            ASSERT_NEAR(out.at(x, y, c), reference.at(x, y, c), 1e-5);
                        }
                    }
        }
}

}  // namespace
}  // namespace postchain::test
