// Stages against pixels computed by hand.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

float gpu_luma(const SettingList& settings, std::initializer_list<float> rgba) {
    const FramePlanes planes = planes_of(constant_image(3, 2, rgba));
    return luma_on_gpu(fxaa_chain(settings), describe(planes), planes).at(1, 1);
}

TEST(Luma, StoredByHand) {
    const SettingList stored = {{"luma", "stored"}};
    EXPECT_NEAR(gpu_luma(stored, {1, 0, 0, 1}), 0.299, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0, 1, 0, 1}), 0.587, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0, 0, 1, 1}), 0.114, 1e-6);
    // 0.5 * 0.299 + 0.25 * 0.587 + 0.75 * 0.114 = 0.1495 + 0.14675 + 0.0855, less 1 - alpha
    EXPECT_NEAR(gpu_luma(stored, {0.5f, 0.25f, 0.75f, 1}), 0.38175, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0.5f, 0.25f, 0.75f, 0.25f}), 0.38175 - 0.75, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0.5f, 0.25f, 0.75f, -2}), 0.38175 - 1, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0.5f, 0.25f, 0.75f, 3}), 0.38175, 1e-6);
    // Negative values are used unchanged: -0.299 + 2 * 0.587
    EXPECT_NEAR(gpu_luma(stored, {-1, 2, 0, 1}), 0.875, 1e-6);
}

TEST(Luma, DisplayByHand) {
    // Gray v: sqrt(v/(1+v)), the weights add up to 1.
    EXPECT_NEAR(gpu_luma({}, {1, 1, 1, 1}), 0.70710678, 1e-6);
    EXPECT_NEAR(gpu_luma({}, {3, 3, 3, 1}), 0.86602540, 1e-6);
    // 0.2126 * sqrt(1/2)
    EXPECT_NEAR(gpu_luma({}, {1, 0, 0, 1}), 0.15033090, 1e-6);
    // max 8: 0.2126 sqrt(8/9) + 0.7152 sqrt(3/9) + 0 = 0.2004412 + 0.4129209
    EXPECT_NEAR(gpu_luma({}, {8, 3, -1, 1}), 0.6133621, 1e-6);
    // One stop up: 0.5 becomes 1.
    EXPECT_NEAR(gpu_luma({{"exposure_ev", 1.0}}, {0.5f, 0.5f, 0.5f, 1}), 0.70710678, 1e-6);
    // Five stops down: 96 becomes 3.
    EXPECT_NEAR(gpu_luma({{"exposure_ev", -5.0}}, {96, 96, 96, 1}), 0.86602540, 1e-6);
}

TEST(Luma, DisplayTakesTheFilesWeights) {
    const FramePlanes planes = planes_of(constant_image(2, 2, {1, 0, 0, 1}));
    FrameDescription frame = describe(planes);
    frame.luma_weights = {0.5, 0.3, 0.2};
    EXPECT_NEAR(luma_on_gpu(fxaa_chain({}), frame, planes).at(0, 0), 0.5 * 0.70710678, 1e-6);
    EXPECT_NEAR(luma_on_gpu(fxaa_chain(stored_settings()), frame, planes).at(0, 0), 0.299, 1e-6);
}

// A color that halves hold has the same luma at both precisions, bit for bit.
TEST(Luma, KeepsEveryBitAtHalfPrecision) {
    ImageF color = noise_image(37, 33, 4, 5, 0.0f, 3.0f);
    for (float& v : color.data) v = std::round(v * 256) / 256;
    const FramePlanes planes = planes_of(color);
    const Chain chain = fxaa_chain({});
    const FrameDescription frame = describe(planes);
    const ImageF full = luma_on_gpu(chain, frame, planes);
    EXPECT_TRUE(equal_bits(full, luma_on_gpu(chain, frame, planes, Precision::fp16)));
    const Difference difference =
        compare(full, reference(chain, frame, planes).stages.at("0.fxaa.luma"), 2e-6);
    EXPECT_EQ(difference.fraction, 0) << difference.text;
}

// White above a horizontal border between rows 3 and 4, black below.
ImageF step_image() {
    return gray_image(16, 8, [](int, int y) { return y < 4 ? 1 : 0; });
}

TEST(Filter, EndlessEdgeByHand) {
    // At (8, 3): M = N = E = W = 1, S = 0, corners 1 1 0 0. Horizontal score 2|1+0-2| + |1+0-2| +
    // |1+0-2| = 4, vertical 0. S has the larger gradient. A = (2*3 + 2)/12 - 1 = -1/3, t = 1/3,
    // F = 1/9 (3 - 2/3) = 7/27, H = (7/27)^2 * 0.75 = 0.05041152. No end is found: both
    // distances are 20.5, the edge offset is 0. Result 1 - H.
    EXPECT_NEAR(run(stored_settings(), step_image()).at(8, 3), 0.94958848, 1e-6);
    // The row below, likewise: H.
    EXPECT_NEAR(run(stored_settings(), step_image()).at(8, 4), 0.05041152, 1e-6);
    // Rows away from the edge have no range.
    EXPECT_EQ(run(stored_settings(), step_image()).at(8, 2), 1.0f);
    EXPECT_EQ(run(stored_settings(), step_image()).at(8, 5), 0.0f);
    // Without the sub-pixel part the image is unchanged.
    EXPECT_EQ(run(stored_settings({{"subpix", 0.0}}), step_image()).at(8, 3), 1.0f);
}

// The border steps down by one row at x = 40: white for y < 4 left of it, y < 5 right of it.
ImageF jog_image() {
    return gray_image(80, 9, [](int x, int y) { return y < (x < 40 ? 4 : 5) ? 1 : 0; });
}

TEST(Filter, TonemappedBlendByHand) {
    // 3 above the border, 0 below: luma sqrt(3/4) and 0, the geometry of the endless edge, weight
    // H = 0.05041152. In the mean of 3 both count 1/sqrt(1 + 3): 3 * 0.94958848.
    const ImageF bright = gray_image(16, 8, [](int, int y) { return y < 4 ? 3 : 0; });
    const ImageF out = run({{"hint", "none"}}, bright);
    EXPECT_NEAR(out.at(8, 3), 2.8487654, 1e-5);
    // In that of 0 the texel of 3 counts 1/2: 0.02520576 beside 0.94958848.
    EXPECT_NEAR(out.at(8, 4), 0.07757256, 1e-6);

    // Maxima in different channels, and alpha: (3, 0, 0, 1) above (0, 1, 0, 0.5). In the mean of
    // the darker one 0.05041152/2 beside 0.94958848/sqrt(2): a share of 0.03618047 of all four
    // channels.
    ImageF colors(16, 8, 4);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 16; ++x) {
            colors.at(x, y, 0) = y < 4 ? 3 : 0;
            colors.at(x, y, 1) = y < 4 ? 0 : 1;
            colors.at(x, y, 3) = y < 4 ? 1.0f : 0.5f;
        }
    }
    const ImageF mixed = run({{"hint", "none"}}, colors);
    EXPECT_NEAR(mixed.at(8, 3, 0), 2.8487654, 1e-5);
    EXPECT_NEAR(mixed.at(8, 3, 1), 0.05041152, 1e-6);
    EXPECT_NEAR(mixed.at(8, 3, 3), 0.97479424, 1e-6);
    EXPECT_NEAR(mixed.at(8, 4, 0), 3 * 0.03618047, 1e-6);
    EXPECT_NEAR(mixed.at(8, 4, 1), 0.96381953, 1e-6);
    EXPECT_EQ(mixed.at(8, 4, 2), 0.0f);
    EXPECT_NEAR(mixed.at(8, 4, 3), 0.51809024, 1e-6);
}

// A line of 40, one pixel high, on 0.1: a box of one pixel keeps all of it. Lumas 0.98773 and
// 0.30151.
TEST(Filter, LineOfLightByHand) {
    const ImageF line = gray_image(16, 9, [](int, int y) { return y == 4 ? 40 : 0.1; });
    // On the line |A|/range = 2/3, H = 400/729 * 0.75 = 0.41152; both texels count the same.
    const ImageF searched = run({{"hint", "none"}}, line);
    EXPECT_NEAR(searched.at(8, 4), 0.58848 * 40 + 0.41152 * 0.1, 1e-3);
    // Beside it the endless edge.
    const double stays = 0.94958848 / std::sqrt(1.1), comes = 0.05041152 / std::sqrt(41.0);
    EXPECT_NEAR(searched.at(8, 3), (stays * 0.1 + comes * 40) / (stays + comes), 1e-5);
    EXPECT_NEAR(searched.at(8, 5), searched.at(8, 3), 1e-6);
    // Directional: weights 0.0941417, 1 and 0.0941417 across the line.
    const ImageF directional = run({{"mode", "directional"}, {"hint", "none"}}, line);
    EXPECT_NEAR(directional.at(8, 4), (40 + 0.2 * 0.0941417) / 1.1882834, 1e-4);
    const double own = 1.0941417 / std::sqrt(1.1), bright = 0.0941417 / std::sqrt(41.0);
    EXPECT_NEAR(directional.at(8, 3), (own * 0.1 + bright * 40) / (own + bright), 1e-5);
    EXPECT_NEAR(directional.at(8, 5), directional.at(8, 3), 1e-6);
}

// A black object above clear: the luma falls from 0 to -1, as at the endless edge, and so does
// alpha.
TEST(Filter, EdgeOfAlphaByHand) {
    ImageF image(16, 8, 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 16; ++x) image.at(x, y, 3) = 1;
    const ImageF searched = run({{"hint", "none"}}, image);
    EXPECT_NEAR(searched.at(8, 3, 3), 0.94958848, 1e-6);
    EXPECT_NEAR(searched.at(8, 4, 3), 0.05041152, 1e-6);
    const ImageF directional = run({{"mode", "directional"}, {"hint", "none"}}, image);
    EXPECT_NEAR(directional.at(8, 3, 3), 1.0941417 / 1.1882834, 1e-6);
    EXPECT_NEAR(directional.at(8, 4, 3), 0.0941417 / 1.1882834, 1e-6);
    for (const ImageF* out : {&searched, &directional}) EXPECT_EQ(out->at(8, 4), 0.0f);
}

// White above black across the full width: every gradient in the tensor is vertical, so the
// coherence is 1, and the rows above and below have weight exp(-0.5/0.46^2) = 0.0941417 relative to
// the center row; along the edge weights are equal.
TEST(Directional, EndlessEdgeByHand) {
    const ImageF out = run(stored_settings({{"mode", "directional"}}), step_image());
    EXPECT_NEAR(out.at(8, 3), 1.0941417 / 1.1882834, 1e-6);
    EXPECT_NEAR(out.at(8, 4), 0.0941417 / 1.1882834, 1e-6);
    EXPECT_EQ(out.at(8, 2), 1.0f);
    EXPECT_EQ(out.at(8, 5), 0.0f);
    const ImageF column = gray_image(8, 16, [](int x, int) { return x < 4 ? 1 : 0; });
    EXPECT_NEAR(run(stored_settings({{"mode", "directional"}}), column).at(3, 8),
                1.0941417 / 1.1882834, 1e-6);
}

// A dot of 1 on black. At M all gradients vanish; at N and S they are (0, 1) and (0, -1), at W and
// E (1, 0) and (-1, 0): no direction, the deviation is 0.5. a = exp(-0.5/0.25) = 0.1353353 beside,
// a^2 = 0.0183156 at the corners.
TEST(Directional, DotByHand) {
    const ImageF out = run(stored_settings({{"mode", "directional"}}),
                           gray_image(9, 9, [](int x, int y) { return x == 4 && y == 4; }));
    const double a = 0.1353353;
    EXPECT_NEAR(out.at(4, 4), 1 / (1 + 4 * a + 4 * a * a), 1e-6);
    EXPECT_EQ(out.at(3, 3), 0.0f);  // the diagonal neighbors have no range
}

TEST(Directional, ThresholdsFollowTheMode) {
    // A range of 0.06 is below 0.0833 and above max(0.0312, 0.063 * 0.8 = 0.0504).
    const ImageF faint = gray_image(16, 8, [](int, int y) { return y < 4 ? 0.8 : 0.74; });
    EXPECT_EQ(run(stored_settings(), faint).at(8, 3), 0.8f);
    EXPECT_NE(run(stored_settings({{"mode", "directional"}}), faint).at(8, 3), 0.8f);
    EXPECT_EQ(
        run(stored_settings({{"mode", "directional"}, {"edge_threshold", 0.1}}), faint).at(8, 3),
        0.8f);
}

TEST(Filter, NegativeColorsAreBlendedAsStored) {
    // -1 above -3, stored luma: the geometry of the endless edge. m = max(0, ...) = 0, T is the
    // identity: -1 - 2 * 0.05041152.
    const ImageF dark = gray_image(16, 8, [](int, int y) { return y < 4 ? -1 : -3; });
    const ImageF out = run({{"luma", "stored"}}, dark);
    EXPECT_NEAR(out.at(8, 3), -1.10082304, 1e-6);
}

// The steps of every preset, copied from FXAA 3.11 and not from the pass.
const std::vector<std::pair<int, std::vector<double>>> kSteps = {
    {10, {1.5, 3, 12}},
    {11, {1, 1.5, 3, 12}},
    {12, {1, 1.5, 2, 4, 12}},
    {13, {1, 1.5, 2, 2, 4, 12}},
    {14, {1, 1.5, 2, 2, 2, 4, 12}},
    {15, {1, 1.5, 2, 2, 2, 2, 4, 12}},
    {20, {1.5, 2, 8}},
    {21, {1, 1.5, 2, 8}},
    {22, {1, 1.5, 2, 2, 8}},
    {23, {1, 1.5, 2, 2, 2, 8}},
    {24, {1, 1.5, 2, 2, 2, 3, 8}},
    {25, {1, 1.5, 2, 2, 2, 2, 4, 8}},
    {26, {1, 1.5, 2, 2, 2, 2, 2, 4, 8}},
    {27, {1, 1.5, 2, 2, 2, 2, 2, 2, 4, 8}},
    {28, {1, 1.5, 2, 2, 2, 2, 2, 2, 2, 4, 8}},
    {29, {1, 1.5, 2, 2, 2, 2, 2, 2, 2, 2, 4, 8}},
    {39, {1, 1, 1, 1, 1, 1.5, 2, 2, 2, 2, 4, 8}},
};

TEST(Filter, EveryPresetWalksItsSteps) {
    const Parameter* row = fxaa::pass_type().parameters->find("preset");
    ASSERT_NE(row, nullptr);
    EXPECT_EQ(row->allowed.size(), kSteps.size());
    const double h = 49.0 / 729 * 0.75;
    for (const auto& [preset, steps] : kSteps) {
        const ImageF out = run(stored_settings({{"preset", int64_t(preset)}}), jog_image());
        double total = 0;
        for (const double step : steps) total += step;
        // k pixels west of the jog: the line's luma is 0.5 up to x = 39, 0.75 at 39.5
        // (0.25 from the mean: gradient/4, an end) and 1 from 40 on, so the end is the first
        // distance >= k - 0.5 that is fetched; the last step is not.
        for (int k = 2; k <= 38; ++k) {
            double found = total, distance = 0;
            for (size_t i = 0; i + 1 < steps.size(); ++i) {
                distance += steps[i];
                if (distance >= k - 0.5) {
                    found = distance;
                    break;
                }
            }
            const double expected = std::max(0.5 - found / (found + total), h);
            EXPECT_NEAR(out.at(40 - k, 4), expected, 1e-6) << "preset " << preset << ", k " << k;
        }
    }
}

}  // namespace
}  // namespace postchain::test
