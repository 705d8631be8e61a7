// Stages against pixels computed by hand.

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

TEST(Luma, ByHand) {
    const SettingList stored = {{"luma", "stored"}};
    const struct {
        SettingList settings;
        std::initializer_list<float> color;
        double luma;
    } rows[] = {{stored, {1, 0, 0, 1}, 0.299},
                {stored, {0, 1, 0, 1}, 0.587},
                {stored, {0, 0, 1, 1}, 0.114},
                // 0.5 * 0.299 + 0.25 * 0.587 + 0.75 * 0.114 = 0.38175, less 1 - alpha
                {stored, {0.5f, 0.25f, 0.75f, 1}, 0.38175},
                {stored, {0.5f, 0.25f, 0.75f, 0.25f}, 0.38175 - 0.75},
                {stored, {0.5f, 0.25f, 0.75f, -2}, 0.38175 - 1},
                {stored, {0.5f, 0.25f, 0.75f, 3}, 0.38175},
                // Negative values are used unchanged: -0.299 + 2 * 0.587
                {stored, {-1, 2, 0, 1}, 0.875},
                // Gray v of the display: sqrt(v/(1+v)), the weights add up to 1.
                {{}, {1, 1, 1, 1}, 0.70710678},
                {{}, {3, 3, 3, 1}, 0.86602540},
                // 0.2126 * sqrt(1/2)
                {{}, {1, 0, 0, 1}, 0.15033090},
                // max 8: 0.2126 sqrt(8/9) + 0.7152 sqrt(3/9) + 0 = 0.2004412 + 0.4129209
                {{}, {8, 3, -1, 1}, 0.6133621},
                // One stop up: 0.5 becomes 1. Five stops down: 96 becomes 3.
                {{{"exposure_ev", 1.0}}, {0.5f, 0.5f, 0.5f, 1}, 0.70710678},
                {{{"exposure_ev", -5.0}}, {96, 96, 96, 1}, 0.86602540}};
    for (const auto& [settings, color, luma] : rows) {
        const FramePlanes planes = planes_of(constant_image(3, 2, color));
        EXPECT_NEAR(luma_on_gpu(fxaa_chain(settings), describe(planes), planes).at(1, 1), luma,
                    1e-6)
            << luma;
    }
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
    EXPECT_TRUE(equal_bits(luma_on_gpu(chain, frame, planes),
                           luma_on_gpu(chain, frame, planes, Precision::fp16)));
}

TEST(Filter, EndlessEdgeByHand) {
    const ImageF out = run(stored_settings(), border(1, 0));
    // At (8, 3): M = N = E = W = 1, S = 0, corners 1 1 0 0. Horizontal score 2|1+0-2| + |1+0-2| +
    // |1+0-2| = 4, vertical 0. S has the larger gradient. A = (2*3 + 2)/12 - 1 = -1/3, t = 1/3,
    // F = 1/9 (3 - 2/3) = 7/27, H = (7/27)^2 * 0.75 = 0.05041152. No end is found: both
    // distances are 20.5, the edge offset is 0. Result 1 - H.
    EXPECT_NEAR(out.at(8, 3), 0.94958848, 1e-6);
    // The row below, likewise: H.
    EXPECT_NEAR(out.at(8, 4), 0.05041152, 1e-6);
    // Rows away from the edge have no range.
    EXPECT_EQ(out.at(8, 2), 1.0f);
    EXPECT_EQ(out.at(8, 5), 0.0f);
    // Without the sub-pixel part the image is unchanged.
    EXPECT_EQ(run(stored_settings({{"subpix", 0.0}}), border(1, 0)).at(8, 3), 1.0f);
}

// The border steps down by one row at x = 40: white for y < 4 left of it, y < 5 right of it.
ImageF jog_image() {
    return gray_image(80, 9, [](int x, int y) { return y < (x < 40 ? 4 : 5) ? 1 : 0; });
}

TEST(Filter, TonemappedBlendByHand) {
    // 3 above the border, 0 below: luma sqrt(3/4) and 0, the geometry of the endless edge, weight
    // H = 0.05041152. In the mean of 3 both count 1/sqrt(1 + 3): 3 * 0.94958848.
    const ImageF out = run({{"hint", "none"}}, border(3, 0));
    EXPECT_NEAR(out.at(8, 3), 2.8487654, 1e-5);
    // In that of 0 the texel of 3 counts 1/2: 0.02520576 beside 0.94958848.
    EXPECT_NEAR(out.at(8, 4), 0.07757256, 1e-6);

    // Maxima in different channels, and alpha: (3, 0, 0, 1) above (0, 1, 0, 0.5). In the mean of
    // the darker one 0.05041152/2 beside 0.94958848/sqrt(2): a share of 0.03618047 of all four
    // channels.
    const float above[] = {3, 0, 0, 1}, below[] = {0, 1, 0, 0.5f};
    const ImageF colors =
        make_image(16, 8, 4, [&](int, int y, int c) { return y < 4 ? above[c] : below[c]; });
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
    const ImageF out = run(stored_settings({{"mode", "directional"}}), border(1, 0));
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

TEST(Filter, NegativeColorsAreBlendedAsStored) {
    // -1 above -3, stored luma: the geometry of the endless edge. m = max(0, ...) = 0, T is the
    // identity: -1 - 2 * 0.05041152.
    EXPECT_NEAR(run({{"luma", "stored"}}, border(-1, -3)).at(8, 3), -1.10082304, 1e-6);
}

// The exposure shapes the blend: the lower, the closer to that of stored values.
TEST(Filter, ExposureShapesTheBlend) {
    const auto blended = [&](double exposure_ev) {
        return run({{"luma", "stored"}, {"exposure_ev", exposure_ev}}, border(3, 0)).at(8, 4);
    };
    EXPECT_NEAR(blended(-32), 3 * 0.05041152, 1e-5);
    EXPECT_LT(blended(32), 1e-5f);
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
        const SettingList settings = stored_settings({{"preset", int64_t(preset)}});
        const ImageF out = run(settings, jog_image());
        int farthest = 0;
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
            if (expected > h) farthest = k;
        }
        EXPECT_EQ(fxaa_chain(settings).reach({}).depends_px, farthest) << "preset " << preset;
    }
}

// Golden results of original FXAA 3.11 on a rendered, display-referred image.
//
// tests/data/fxaa/input.rgbf is a crop of the image; preset_12.rgbf and preset_39.rgbf are FXAA
// 3.11's results for the interior of that crop (subpix 0.75, thresholds 0.166 and 0.0833, luma
// 0.299, 0.587, 0.114 of the stored values). The margin is wider than the longest search.
// A file is one line of text, "rgbf WIDTH HEIGHT", and the rows of little-endian floats.

ImageF load(const std::string& name) {
    std::ifstream in(std::string(POSTCHAIN_SOURCE_DIR) + "/tests/data/fxaa/" + name,
                     std::ios::binary);
    std::string magic;
    int width = 0, height = 0;
    in >> magic >> width >> height;
    in.get();
    EXPECT_TRUE(in.good() && magic == "rgbf") << name;
    if (!in.good()) return {};
    ImageF rgb(width, height, 3);
    in.read(reinterpret_cast<char*>(rgb.data.data()),
            static_cast<std::streamsize>(rgb.data.size() * sizeof(float)));
    EXPECT_TRUE(in.good()) << name;
    return rgb;
}

TEST(Golden, EqualsOriginalFxaa) {
    const ImageF input = load("input.rgbf");
    ASSERT_FALSE(input.empty());
    ImageF color(input.width, input.height, 4, 1.0f);
    for (int y = 0; y < input.height; ++y)
        for (int x = 0; x < input.width; ++x)
            for (int c = 0; c < 3; ++c) color.at(x, y, c) = input.at(x, y, c);
    for (const int64_t preset : {12, 39}) {
        const ImageF golden = load("preset_" + std::to_string(preset) + ".rgbf");
        ASSERT_FALSE(golden.empty());
        const ImageF out = run(stored_settings({{"preset", preset}}), color);
        const int margin_x = (input.width - golden.width) / 2;
        const int margin_y = (input.height - golden.height) / 2;
        ImageF inner(golden.width, golden.height, 3);
        int moved = 0;
        for (int y = 0; y < golden.height; ++y) {
            for (int x = 0; x < golden.width; ++x) {
                for (int c = 0; c < 3; ++c)
                    inner.at(x, y, c) = out.at(x + margin_x, y + margin_y, c);
                moved +=
                    std::abs(golden.at(x, y, 1) - input.at(x + margin_x, y + margin_y, 1)) > 2e-4f;
            }
        }
        EXPECT_GT(moved, int(golden.pixels() / 5));  // the crop is demanding
        const Difference difference = compare(inner, golden, 2e-4);
        EXPECT_LE(difference.fraction, 0.001) << "preset " << preset << ": " << difference.text;
    }
}

}  // namespace
}  // namespace postchain::test
