// The hint: the report's checkerboard simulated literally, and the effect of each choice.

#include <cmath>
#include <cstdio>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

SettingList hinted(const char* hint, const char* gate = "tile") {
    return {{"luma", std::string("stored")},
            {"blend", std::string("stored")},
            {"hint", std::string(hint)},
            {"hint_gate", std::string(gate)}};
}

const char* const kPlain = "none";

ImageD filtered_with_luma(const SettingList& settings, const ImageF& color, const ImageD& luma) {
    return fxaa::reference_fxaa(parameters_of(settings), image_cast<double>(color), luma, nullptr);
}

ImageD checker_luma(int width, int height) {
    ImageD luma(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) luma.at(x, y) = (x + y) & 1;
    return luma;
}

TEST(Checkerboard, LiteralLumaEqualsTheShortCut) {
    // By hand, M = m in {0, 1}: N = S = E = W = 1 - m, corners m. Range 1 >= any threshold. Scores
    // 2|2(1-m) - 2m| + 2 |2m - 2(1-m)| = 8 both ways: horizontal. Gradients 1 and 1: N. Pair mean
    // 0.5. A = (8(1-m) + 4m)/12 - m = 2/3 - 4m/3, |A| = 2/3, t = 2/3, F = 4/9 (3 - 4/3) = 20/27,
    // H = 400/729 subpix = 0.5487 subpix. On the line every luma is 0.5: no end, the whole search,
    // equal distances, edge offset 0. So: N with weight H, whatever m.
    const ImageF color = noise_image(80, 60, 4, 11);
    for (const int64_t preset : fxaa::presets()) {
        for (const double subpix : {0.0, 0.75, 1.0}) {
            SettingList settings = hinted("checkerboard");
            settings.push_back({"preset", preset});
            settings.push_back({"subpix", subpix});
            const ImageD literal = filtered_with_luma(settings, color, checker_luma(80, 60));
            const ImageF gpu = run(settings, color, constant_hint(80, 60, 1, 0));
            const double k = 400.0 / 729 * subpix;
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

// A row of 1e9 above black, weighted 1/sqrt(1 + 1e9) = 3.2e-5; k is the weight of the black.
TEST(Checkerboard, BrightRowUnderBlackKeepsItsDigits) {
    const ImageF color = gray_image(20, 10, [](int, int y) { return y == 5 ? 1e9 : 0.0; });
    auto settings = hinted("checkerboard");
    for (auto& [key, value] : settings)
        if (key == "blend") value = std::string("tonemapped");
    const ImageF out = run(settings, color, constant_hint(20, 10, 1, 1));
    const double k = 400.0 / 729 * 0.75, counts = 1 / std::sqrt(1 + 1e9);
    for (int x = 0; x < 20; ++x) {
        const double share = counts * (1 - k) / (counts * (1 - k) + k);
        EXPECT_NEAR(out.at(x, 5) / (1e9 * share), 1, 1e-5);
        // Black under the bright row.
        const double under = counts * k / (counts * k + 1 - k);
        EXPECT_NEAR(out.at(x, 6) / (1e9 * under), 1, 1e-5);
    }
}

TEST(Checkerboard, LeavesTheTopRowAlone) {
    // The upper neighbor of row 0 is row 0 itself.
    const ImageF color = noise_image(20, 10, 4, 12);
    const ImageF out = run(hinted("checkerboard"), color, constant_hint(20, 10, 1, 1));
    for (int x = 0; x < 20; ++x)
        for (int c = 0; c < 4; ++c) EXPECT_EQ(out.at(x, 0, c), color.at(x, 0, c));
    // Not reproduced: a literal checkerboard clamped at the edge selects W in the first and the
    // last row. M = N = m, W = E = S = 1 - m: horizontal score 2 + 2, vertical 4 + 2 + 2; W by the
    // tie; A = (2 (3 - 2m) + 2)/12 - m = 2/3 - 4m/3 as inside.
    const ImageD literal = filtered_with_luma(hinted("checkerboard"), color, checker_luma(20, 10));
    const double k = 400.0 / 729 * 0.75;
    for (const int y : {0, 9})
        for (int x = 1; x < 19; ++x)
            EXPECT_NEAR(literal.at(x, y), (1 - k) * color.at(x, y) + k * color.at(x - 1, y), 1e-6);
}

TEST(Checkerboard, AtTheBorderOfAnAreaTheShortCutKeepsToTheGate) {
    // An area of 60x60 in a smooth static image. Literal: the checkerboard's luma inside, the real
    // luma outside.
    const int size = 120, from = 30, to = 90;
    const ImageF color = gray_image(size, size, [](int x, int y) {
        return 0.5 + 0.1 * std::sin(0.11 * x) * std::cos(0.13 * y);
    });
    ImageD luma = fxaa::reference_luma(parameters_of(hinted("none")), image_cast<double>(color),
                                       {0.299, 0.587, 0.114});
    ImageF hint(size, size, 2);
    for (int y = from; y < to; ++y) {
        for (int x = from; x < to; ++x) {
            luma.at(x, y) = (x + y) & 1;
            hint.at(x, y, 0) = 1;
        }
    }
    const ImageD literal = filtered_with_luma(hinted("checkerboard"), color, luma);
    const ImageF short_cut = run(hinted("checkerboard"), color, hint);
    int spill = 0, ring = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double d = std::abs(short_cut.at(x, y) - literal.at(x, y));
            const int outside = std::max({from - x, x - (to - 1), from - y, y - (to - 1)});
            // Inside, one pixel or more from the border: equal. (The search is cut off by a mean
            // that differs from 0.5 by less than 1/4: outside, this image is near 0.5.)
            if (outside <= -1) {
                EXPECT_LT(d, 1e-6) << x << "," << y;
            }
            // Two pixels outside: unchanged in both.
            if (outside >= 2) {
                EXPECT_EQ(short_cut.at(x, y), color.at(x, y));
                EXPECT_EQ(literal.at(x, y), double(color.at(x, y)));
            }
            // The ring in between: the shortcut leaves it unchanged, the literal luma disturbs it.
            if (outside == 1) {
                ++ring;
                EXPECT_EQ(short_cut.at(x, y), color.at(x, y));
                spill += literal.at(x, y) != double(color.at(x, y));
            }
        }
    }
    EXPECT_EQ(ring, 4 * 61);
    std::printf("literal checkerboard disturbs %d of %d pixels around its area\n", spill, ring);
    EXPECT_GT(spill, ring / 2);
}

TEST(Checkerboard, AFractionalHintLiesBetweenPlainAndTwoTaps) {
    const ImageF color = noise_image(48, 32, 4, 13);
    const ImageF plain = run(hinted(kPlain), color);
    const ImageF taps = run(hinted("checkerboard"), color, constant_hint(48, 32, 1, 1));
    for (const float h : {0.25f, 0.5f, 0.9f}) {
        const ImageF out = run(hinted("checkerboard"), color, constant_hint(48, 32, h, 0));
        for (size_t i = 0; i < out.data.size(); ++i)
            EXPECT_NEAR(out.data[i], (1 - h) * plain.data[i] + h * taps.data[i], 1e-6);
    }
    EXPECT_TRUE(equal_bits(run(hinted("checkerboard"), color, constant_hint(48, 32, 0, 1)), plain));
    // Continuous at both ends.
    const ImageF nearly = run(hinted("checkerboard"), color, constant_hint(48, 32, 0.9999f, 0));
    EXPECT_EQ(compare(nearly, taps, 2e-4).fraction, 0);
    const ImageF hardly = run(hinted("checkerboard"), color, constant_hint(48, 32, 1e-4f, 0));
    EXPECT_EQ(compare(hardly, plain, 2e-4).fraction, 0);
}

TEST(Threshold, AFullHintIsBothThresholdsZero) {
    const ImageF color = noise_image(48, 32, 4, 14, 0.4f, 0.6f);
    SettingList zero = hinted(kPlain);
    zero.push_back({"edge_threshold", 0.0});
    zero.push_back({"edge_threshold_min", 0.0});
    const ImageF expected = run(zero, color);
    EXPECT_TRUE(equal_bits(run(hinted("threshold"), color, constant_hint(48, 32, 1, 0)), expected));
    EXPECT_FALSE(equal_bits(run(hinted(kPlain), color), expected));
}

TEST(Threshold, AFractionalHintScalesBothThresholds) {
    const ImageF color = noise_image(48, 32, 4, 15, 0.2f, 0.5f);
    SettingList half = hinted(kPlain);
    half.push_back({"edge_threshold", 0.083});
    half.push_back({"edge_threshold_min", 0.04165});
    const ImageF expected = run(half, color);
    const ImageF out = run(hinted("threshold"), color, constant_hint(48, 32, 0.5f, 0));
    EXPECT_TRUE(equal_bits(out, expected));
    EXPECT_FALSE(equal_bits(out, run(hinted(kPlain), color)));
}

TEST(Hint, TheGateChoosesTheChannel) {
    const ImageF color = noise_image(48, 32, 4, 16, 0.4f, 0.6f);
    for (const char* hint : {"checkerboard", "threshold"}) {
        const ImageF plain = run(hinted(kPlain), color);
        const ImageF tile_only = constant_hint(48, 32, 1, 0);
        const ImageF pixel_only = constant_hint(48, 32, 0, 1);
        EXPECT_TRUE(equal_bits(run(hinted(hint, "pixel"), color, tile_only), plain));
        EXPECT_TRUE(equal_bits(run(hinted(hint, "tile"), color, pixel_only), plain));
        EXPECT_FALSE(equal_bits(run(hinted(hint, "tile"), color, tile_only), plain));
        EXPECT_TRUE(equal_bits(run(hinted(hint, "tile"), color, tile_only),
                               run(hinted(hint, "pixel"), color, pixel_only)));
    }
}

TEST(Hint, WithoutAPlaneItIsPlainFxaa) {
    const ImageF color = noise_image(48, 32, 4, 17);
    const ImageF plain = run(hinted(kPlain), color);
    for (const char* hint : {"checkerboard", "threshold"})
        EXPECT_TRUE(equal_bits(run(hinted(hint), color), plain));
    // And with hint none the plane is not read.
    EXPECT_TRUE(equal_bits(run(hinted(kPlain), color, constant_hint(48, 32, 1, 1)), plain));
}

TEST(Hint, IsReadOnlyByThoseWhoAsk) {
    for (const char* hint : {"none", "checkerboard", "threshold"}) {
        const Chain chain = fxaa_chain(hinted(hint));
        const RoleUse use = chain.links[0].pass->roles();
        EXPECT_EQ(use.required, RoleSet({Role::color}));
        EXPECT_EQ(use.optional.has(Role::hint), std::string(hint) != "none");
        const FramePlanes planes = planes_of(noise_image(8, 8, 4, 1), constant_hint(8, 8, 1, 1));
        auto plan = make_plan(chain, describe(planes));
        ASSERT_TRUE(plan.ok());
        EXPECT_EQ(plan->reads.has(Role::hint), std::string(hint) != "none");
    }
}

// A faint static horizontal line in row 20, in a tile of motion but not moving itself (tile gate
// open, pixel gate closed).
TEST(Hint, MovesStaticDetailInATileOnlyAsACheckerboard) {
    const ImageF line = gray_image(64, 40, [](int, int y) { return y == 20 ? 0.05 : 0; });
    // out(y) = (1-k) in(y) + k in(y-1): down by k = 400/729 * 0.75 px. The threshold softens it in
    // place: the line contributes equally to the rows above and below.
    const std::tuple<const char*, const char*, double> cases[] = {{"checkerboard", "tile", 0.4115},
                                                                  {"checkerboard", "pixel", 0},
                                                                  {"threshold", "pixel", 0},
                                                                  {"none", "tile", 0},
                                                                  {"threshold", "tile", 0}};
    for (const auto& [hint, gate, moved_px] : cases) {
        const ImageF out = run(hinted(hint, gate), line, constant_hint(64, 40, 1, 0));
        double sum = 0, moment = 0;
        for (int y = 0; y < 40; ++y) {
            sum += out.at(32, y);
            moment += double(out.at(32, y)) * y;
        }
        EXPECT_NEAR(moment / sum - 20, moved_px, moved_px > 0 ? 1e-4 : 1e-6) << hint << gate;
    }
}

// The hint passes a depth of field between motion blur and FXAA.
TEST(Hint, TravelsWithAndWithoutAPassInBetween) {
    // Everything moves, and the square is far out of focus.
    TestFrame frame = layered_frame(64, 48, {17.0f, 9.0f}, {-4.0f, 0.0f}, 11);
    frame.description.camera.f_stop = 0.2;
    const auto chain_with = [&](bool between, const char* hint) {
        Chain chain;
        append(chain, "motion_blur", {{"mode", "guertin"}});
        if (between) append(chain, "depth_of_field", {{"method", "gilham"}});
        append(chain, "fxaa", {{"hint", std::string(hint)}});
        return chain;
    };
    for (bool between : {false, true}) {
        Plan without, with;
        const auto plain =
            filter(chain_with(between, "none"), frame.description, frame.planes, {}, &without);
        const auto hinted =
            filter(chain_with(between, "checkerboard"), frame.description, frame.planes, {}, &with);
        EXPECT_FALSE(equal_bits(plain.at(Role::color), hinted.at(Role::color)));
        const auto has_hint = [](const Plan& plan) {
            return std::any_of(plan.textures.begin(), plan.textures.end(), [](const auto& texture) {
                return texture.name.find("hint") != std::string::npos;
            });
        };
        EXPECT_FALSE(has_hint(without)) << "made a plane that no step reads";
        EXPECT_TRUE(has_hint(with));
    }
}

}  // namespace
}  // namespace postchain::test
