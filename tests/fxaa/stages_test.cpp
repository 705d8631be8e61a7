// Every stage against the double-precision reference, and against pixels computed by hand.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/fxaa/support.h"

namespace postchain::test {
namespace {

using fxaa::Parameters;

float gpu_luma(const SettingList& settings, std::initializer_list<float> rgba) {
    const FramePlanes planes = planes_of(constant_image(3, 2, rgba));
    return luma_on_gpu(fxaa_chain(settings), describe(planes), planes).at(1, 1);
}

TEST(Luma, StoredByHand) {
    const SettingList stored = {{"luma", std::string("stored")}};
    EXPECT_NEAR(gpu_luma(stored, {1, 0, 0, 1}), 0.299, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0, 1, 0, 1}), 0.587, 1e-6);
    EXPECT_NEAR(gpu_luma(stored, {0, 0, 1, 1}), 0.114, 1e-6);
    // 0.5 * 0.299 + 0.25 * 0.587 + 0.75 * 0.114 = 0.1495 + 0.14675 + 0.0855
    EXPECT_NEAR(gpu_luma(stored, {0.5f, 0.25f, 0.75f, 0}), 0.38175, 1e-6);
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

TEST(Luma, NonFiniteTexelsHaveAFiniteLuma) {
    const float inf = INFINITY;
    EXPECT_EQ(gpu_luma({}, {NAN, NAN, NAN, 1}), 0.0f);
    EXPECT_NEAR(gpu_luma({}, {inf, inf, inf, 1}), 1.0, 1e-5);
    EXPECT_NEAR(gpu_luma({}, {1, NAN, 0, 1}), 0.15033090, 1e-6);
    EXPECT_NEAR(gpu_luma({{"luma", std::string("stored")}}, {NAN, 1, 0, 1}), 0.587, 1e-6);
    EXPECT_TRUE(std::isfinite(gpu_luma({{"luma", std::string("stored")}}, {-inf, inf, 1, 1})));
    EXPECT_NEAR(gpu_luma({}, {3e38f, 3e38f, 3e38f, 1}), 1.0, 1e-5);
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

TEST(Filter, JogByHand) {
    const ImageF out = run(stored_settings(), jog_image());
    // (38, 4): M = 0, N = 1. The line y = 3.5 has luma 0.5 = pair mean up to x = 39 and 1 from 40
    // on. East: at 1 (x = 39) 0.5, at 2.5 (x = 40.5) 1, end. West: none, 20.5. The end (+0.5) and
    // M - mean (-0.5) differ: offset 0.5 - 2.5/23 = 0.39130435.
    EXPECT_NEAR(out.at(38, 4), 0.39130435, 1e-6);
    // (41, 4): M = 1, S = 0, line y = 4.5, west: 0.5 at 40, 0 at 38.5; result 1 - 0.39130435.
    EXPECT_NEAR(out.at(41, 4), 0.60869565, 1e-6);
    // (36, 4): east 0.5 at 37 and 38.5, 1 at 40.5: distance 4.5, offset 0.5 - 4.5/25 = 0.32.
    EXPECT_NEAR(out.at(36, 4), 0.32, 1e-6);
    // (36, 3): M = 1, S = 0, same line and end (+0.5), but M - mean = +0.5: the sign is the same,
    // so the edge offset is ignored and H = 0.05041152 remains.
    EXPECT_NEAR(out.at(36, 3), 0.94958848, 1e-6);
    // (32, 4): 8.5 steps beyond the jog by half a texel: offset 0.5 - 8.5/29 = 0.20689655.
    EXPECT_NEAR(out.at(32, 4), 0.20689655, 1e-6);
}

TEST(Filter, JogInAColumnByHand) {
    // The same image with x and y exchanged: W replaces N.
    const ImageF turned =
        gray_image(9, 80, [](int x, int y) { return x < (y < 40 ? 4 : 5) ? 1 : 0; });
    const ImageF out = run(stored_settings(), turned);
    EXPECT_NEAR(out.at(4, 38), 0.39130435, 1e-6);
    EXPECT_NEAR(out.at(4, 41), 0.60869565, 1e-6);
    EXPECT_NEAR(out.at(4, 36), 0.32, 1e-6);
    EXPECT_NEAR(out.at(3, 36), 0.94958848, 1e-6);
}

TEST(Filter, DotByHand) {
    const ImageF out =
        run(stored_settings(), gray_image(9, 9, [](int x, int y) { return x == 4 && y == 4; }));
    // M = 1, everything else 0: A = -1, t = F = 1, H = 0.75; N by the tie rules; both ends at 1.
    EXPECT_NEAR(out.at(4, 4), 0.25, 1e-6);
    // Above it: A = 2/12, t = 1/6, F = 1/36 (3 - 1/3) = 2/27, H = 4/729 * 0.75; the scores tie at
    // 2, so horizontal, S. The ends are at 1 and 1: no edge offset.
    EXPECT_NEAR(out.at(4, 3), 0.00411523, 1e-7);
    EXPECT_NEAR(out.at(4, 5), 0.00411523, 1e-7);
    // Beside it the scores tie again (2 and 2): horizontal, and neither N nor S has a gradient.
    EXPECT_EQ(out.at(3, 4), 0.0f);
    // Diagonal neighbors have no range.
    EXPECT_EQ(out.at(3, 3), 0.0f);
}

TEST(Filter, TonemappedBlendByHand) {
    // 3 above the border, 0 below: luma sqrt(3/4) and 0, the geometry of the endless edge, weight
    // H = 0.05041152. 3 counts 1/sqrt(1 + 3) = 1/2: 0.94958848/2 = 0.47479424 beside 0.05041152.
    const ImageF bright = gray_image(16, 8, [](int, int y) { return y < 4 ? 3 : 0; });
    const ImageF out = run({{"hint", std::string("none")}}, bright);
    EXPECT_NEAR(out.at(8, 3), 2.7120470, 1e-5);
    // From below: 0.02520576 beside 0.94958848.
    EXPECT_NEAR(out.at(8, 4), 0.07757256, 1e-6);

    // Maxima in different channels, and alpha: (3, 0, 0, 1) above (0, 1, 0, 0.5), which counts
    // 1/sqrt(2): a share of 0.03564633/(0.47479424 + 0.03564633) = 0.06983443 of all four channels.
    ImageF colors(16, 8, 4);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 16; ++x) {
            colors.at(x, y, 0) = y < 4 ? 3 : 0;
            colors.at(x, y, 1) = y < 4 ? 0 : 1;
            colors.at(x, y, 3) = y < 4 ? 1.0f : 0.5f;
        }
    }
    const ImageF mixed = run({{"hint", std::string("none")}}, colors);
    EXPECT_NEAR(mixed.at(8, 3, 0), 2.7904967, 1e-5);
    EXPECT_NEAR(mixed.at(8, 3, 1), 0.06983443, 1e-6);
    EXPECT_EQ(mixed.at(8, 3, 2), 0.0f);
    EXPECT_NEAR(mixed.at(8, 3, 3), 0.96508278, 1e-6);
}

// White above black across the full width: every gradient in the tensor is vertical, so the
// coherence is 1, and the rows above and below have weight exp(-0.5/0.46^2) = 0.0941417 relative to
// the center row; along the edge weights are equal.
TEST(Directional, EndlessEdgeByHand) {
    const ImageF out = run(stored_settings({{"mode", std::string("directional")}}), step_image());
    EXPECT_NEAR(out.at(8, 3), 1.0941417 / 1.1882834, 1e-6);
    EXPECT_NEAR(out.at(8, 4), 0.0941417 / 1.1882834, 1e-6);
    EXPECT_EQ(out.at(8, 2), 1.0f);
    EXPECT_EQ(out.at(8, 5), 0.0f);
    const ImageF column = gray_image(8, 16, [](int x, int) { return x < 4 ? 1 : 0; });
    EXPECT_NEAR(run(stored_settings({{"mode", std::string("directional")}}), column).at(3, 8),
                1.0941417 / 1.1882834, 1e-6);
}

// A dot of 1 on black. At M all gradients vanish; at N and S they are (0, 1) and (0, -1), at W and
// E (1, 0) and (-1, 0): no direction, the deviation is 0.5. a = exp(-0.5/0.25) = 0.1353353 beside,
// a^2 = 0.0183156 at the corners.
TEST(Directional, DotByHand) {
    const ImageF out = run(stored_settings({{"mode", std::string("directional")}}),
                           gray_image(9, 9, [](int x, int y) { return x == 4 && y == 4; }));
    const double a = 0.1353353;
    EXPECT_NEAR(out.at(4, 4), 1 / (1 + 4 * a + 4 * a * a), 1e-6);
    EXPECT_EQ(out.at(3, 3), 0.0f);  // the diagonal neighbors have no range
}

// 3 above the border, 0 below: 3 counts 1/sqrt(1 + 3) = 1/2, its alpha too.
TEST(Directional, TonemappedByHand) {
    ImageF bright = gray_image(16, 8, [](int, int y) { return y < 4 ? 3 : 0; });
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) bright.at(x, y, 3) = y < 4 ? 1.0f : 0.5f;
    const ImageF out =
        run({{"mode", std::string("directional")}, {"hint", std::string("none")}}, bright);
    EXPECT_NEAR(out.at(8, 3), 3 * 0.5 * 1.0941417 / (0.5 * 1.0941417 + 0.0941417), 1e-5);
    EXPECT_NEAR(out.at(8, 4), 3 * 0.5 * 0.0941417 / (0.5 * 0.0941417 + 1.0941417), 1e-6);
    const double share = 0.0941417 / (0.5 * 1.0941417 + 0.0941417);
    EXPECT_NEAR(out.at(8, 3, 3), 1 - 0.5 * share, 1e-6);
}

TEST(Directional, ThresholdsFollowTheMode) {
    // A range of 0.06 is below 0.0833 and above max(0.0312, 0.063 * 0.8 = 0.0504).
    const ImageF faint = gray_image(16, 8, [](int, int y) { return y < 4 ? 0.8 : 0.74; });
    EXPECT_EQ(run(stored_settings(), faint).at(8, 3), 0.8f);
    EXPECT_NE(run(stored_settings({{"mode", std::string("directional")}}), faint).at(8, 3), 0.8f);
    EXPECT_EQ(
        run(stored_settings({{"mode", std::string("directional")}, {"edge_threshold", 0.1}}), faint)
            .at(8, 3),
        0.8f);
}

// Edges sampled once per pixel, against the mean over the pixel: the search suits long edges near
// rows and columns, the Gaussian is closer from a slope of 0.6 on.
TEST(Directional, SlantedEdgesAgainstTheLongestSearch) {
    for (const double slope : {0.3, 0.6, 0.8, 1.0}) {
        const ImageF aliased = slanted_edge(96, 96, slope, 7.3, 0.1, 0.9, 1);
        const ImageF exact = slanted_edge(96, 96, slope, 7.3, 0.1, 0.9, 16);
        const double none = rms_difference(aliased, exact, 24);
        const double longest =
            rms_difference(run(stored_settings({{"preset", int64_t(39)}}), aliased), exact, 24);
        const double directional = rms_difference(
            run(stored_settings({{"mode", std::string("directional")}}), aliased), exact, 24);
        std::printf("slope %.1f: rms error %.4f, preset 39 %.4f, directional %.4f\n", slope, none,
                    longest, directional);
        EXPECT_LT(directional, 0.75 * none) << slope;
        if (slope >= 0.6) {
            EXPECT_LT(directional, longest) << slope;
        }
    }
}

TEST(Filter, NegativeColorsAreBlendedAsStored) {
    // -1 above -3, stored luma: the geometry of the endless edge. m = max(0, ...) = 0, T is the
    // identity: -1 - 2 * 0.05041152.
    const ImageF dark = gray_image(16, 8, [](int, int y) { return y < 4 ? -1 : -3; });
    const ImageF out = run({{"luma", std::string("stored")}}, dark);
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
        // k pixels west of the jog (JogByHand): the line's luma is 0.5 up to x = 39, 0.75 at 39.5
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

// ---- GPU against reference -----------------------------------------------------------------

// An image with edges of all slopes, noise and highlights up to 40; alpha in 0..1.
ImageF busy_image(int width, int height) {
    ImageF image = noise_image(width, height, 4, 7, 0.0f, 0.15f);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double dx = x - 0.4 * width, dy = y - 0.5 * height;
            const double radius = std::hypot(dx, 1.3 * dy);
            if (radius < 0.35 * height)
                for (int c = 0; c < 3; ++c) image.at(x, y, c) += float(0.5 + 0.2 * c);
            if (std::fmod(std::abs(0.31 * x + y), 17.0) < 1.2) image.at(x, y, 1) += 1.7f;
            if (std::fmod(std::abs(x - 0.12 * y), 23.0) < 1.0) image.at(x, y, 0) += 0.8f;
            if ((x * 7 + y * 13) % 97 == 0) image.at(x, y, 2) = 40;
            image.at(x, y, 3) = std::min(1.0f, 5 * image.at(x, y, 3));
        }
    }
    return image;
}

// Fractional and full gates in bands, none on the right.
ImageF banded_hint(int width, int height) {
    ImageF hint(width, height, 2);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            hint.at(x, y, 0) = x < width / 2 ? float(y % 3) / 2 : 0;
            hint.at(x, y, 1) = x < width / 3 ? 1.0f : std::max(0.0f, 1 - float(x) / float(width));
        }
    }
    return hint;
}

// Ties in fp32: the two scores, the two gradients, or range and threshold are within 2e-6 of each
// other. Equal scores are common: if M, N, S, E, W bend in alternating senses, both scores are the
// same sum. Double rounds such ties its own way.
bool tied(const ImageD& luma, int x, int y, const Parameters& p, double threshold_scale) {
    auto at = [&](int dx, int dy) {
        return luma.at(std::clamp(x + dx, 0, luma.width - 1),
                       std::clamp(y + dy, 0, luma.height - 1));
    };
    const double m = at(0, 0), n = at(0, -1), s = at(0, 1), w = at(-1, 0), e = at(1, 0);
    const double nw = at(-1, -1), ne = at(1, -1), sw = at(-1, 1), se = at(1, 1);
    const double rows =
        2 * std::abs(n + s - 2 * m) + std::abs(ne + se - 2 * e) + std::abs(nw + sw - 2 * w);
    const double columns =
        2 * std::abs(w + e - 2 * m) + std::abs(nw + ne - 2 * n) + std::abs(sw + se - 2 * s);
    const double a = rows >= columns ? n : w, b = rows >= columns ? s : e;
    const double highest = std::max({m, n, s, w, e});
    const double range = highest - std::min({m, n, s, w, e});
    const double threshold =
        threshold_scale * std::max(thresholds(p).least, thresholds(p).relative * highest);
    auto near = [](double u, double v) { return std::abs(u - v) < 2e-6; };
    if (p.mode == fxaa::Mode::directional) return near(range, threshold);
    return near(rows, columns) || near(std::abs(a - m), std::abs(b - m)) || near(range, threshold);
}

// Bounds: luma 2e-6. fxaa 5e-5 relative to max(1, |value|), except for tied pixels, of which there
// are at most `ties`, and one pixel in a thousand whose search ends on a tie.
void expect_near_reference(const SettingList& settings, const ImageF& color, const ImageF& hint,
                           double ties = 0.04) {
    const FramePlanes planes = planes_of(color, hint);
    const Chain chain = fxaa_chain(settings);
    const FrameDescription frame = describe(planes);
    PlanOptions options{.elide = false};
    const Stages gpu = filter_with_stages(chain, frame, planes, options);
    const ReferenceFrame cpu = reference(chain, frame, planes);
    ASSERT_EQ(gpu.stages.size(), 2u);
    ASSERT_EQ(cpu.stages.size(), 2u);
    ImageF ours = gpu.stages.at("0.fxaa.fxaa");
    const ImageD& theirs = cpu.stages.at("0.fxaa.fxaa");
    ASSERT_EQ(ours.data.size(), theirs.data.size());
    EXPECT_TRUE(equal_bits(gpu.outputs.at(Role::color), ours));
    const Parameters parameters = parameters_of(settings);
    const ImageD& cpu_luma = cpu.stages.at("0.fxaa.luma");
    const Difference luma = compare(gpu.stages.at("0.fxaa.luma"), cpu_luma, 2e-6);
    EXPECT_EQ(luma.fraction, 0) << chain.text() << ": luma " << luma.text;
    int tied_pixels = 0;
    for (int y = 0; y < ours.height; ++y) {
        for (int x = 0; x < ours.width; ++x) {
            double scale = 1;
            if (!hint.empty() && parameters.hint == fxaa::Hint::threshold)
                scale -= hint.at(x, y, parameters.hint_gate == fxaa::HintGate::pixel ? 1 : 0);
            if (!tied(cpu_luma, x, y, parameters, scale)) continue;
            bool differs = false;
            for (int c = 0; c < 4; ++c) {
                differs |= std::abs(ours.at(x, y, c) - theirs.at(x, y, c)) > 5e-5;
                ours.at(x, y, c) = float(theirs.at(x, y, c));
            }
            tied_pixels += differs;
        }
    }
    EXPECT_LE(tied_pixels, std::max(1.0, ties * double(ours.pixels()))) << chain.text();
    const Difference result = compare(ours, theirs, 5e-5);
    EXPECT_LE(result.fraction, 0.001) << chain.text() << ": fxaa " << result.text;
}

TEST(Reference, EveryPreset) {
    const ImageF picture = busy_image(96, 61);
    for (const int64_t preset : fxaa::presets())
        expect_near_reference({{"preset", preset}}, picture, {});
}

TEST(Reference, DirectionalWithEveryLumaBlendAndHint) {
    const ImageF picture = busy_image(96, 61);
    const ImageF hint = banded_hint(96, 61);
    for (const char* luma : {"stored", "display"})
        for (const char* blend : {"stored", "tonemapped"})
            for (const char* kind : {"none", "checkerboard", "threshold"})
                expect_near_reference({{"mode", std::string("directional")},
                                       {"luma", std::string(luma)},
                                       {"blend", std::string(blend)},
                                       {"hint", std::string(kind)}},
                                      picture, hint, 0);
    for (const double ev : {-32.0, -3.0, 4.0, 32.0})
        expect_near_reference({{"mode", std::string("directional")}, {"exposure_ev", ev}}, picture,
                              {}, 0);
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {2, 2}, {3, 5}, {17, 31}})
        expect_near_reference({{"mode", std::string("directional")}}, busy_image(width, height),
                              banded_hint(width, height), 0);
}

TEST(Reference, EveryLumaBlendHintAndGate) {
    const ImageF picture = busy_image(96, 61);
    const ImageF hint = banded_hint(96, 61);
    for (const char* luma : {"stored", "display"})
        for (const char* blend : {"stored", "tonemapped"})
            for (const char* kind : {"none", "checkerboard", "threshold"})
                for (const char* gate : {"tile", "pixel"})
                    expect_near_reference({{"luma", std::string(luma)},
                                           {"blend", std::string(blend)},
                                           {"hint", std::string(kind)},
                                           {"hint_gate", std::string(gate)}},
                                          picture, hint);
}

TEST(Reference, EndsOfEveryNumber) {
    const ImageF picture = busy_image(96, 61);
    for (const double end : {0.0, 1.0})
        for (const char* key : {"subpix", "edge_threshold", "edge_threshold_min"})
            expect_near_reference({{key, end}}, picture, {});
    for (const double ev : {-32.0, -3.0, 4.0})
        expect_near_reference({{"exposure_ev", ev}}, picture, {});
    expect_near_reference({{"exposure_ev", 32.0}}, picture, {});
}

TEST(Reference, OddSizes) {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {2, 2}, {3, 5}, {17, 31}})
        expect_near_reference({}, busy_image(width, height), banded_hint(width, height));
}

}  // namespace
}  // namespace postchain::test
