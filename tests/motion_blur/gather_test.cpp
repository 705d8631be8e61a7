// The gather and the hint against pixels computed by hand.
//
// N = 3 without jitter puts the taps at t = -1/2, 0, 1/2: the outer two along w_max, the center one
// along w_c. With |v_max| = 4 the outer taps are at T = 2. Depths are equal unless stated: f = b =
// 1.

#include <cmath>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

// The result of so many taps.
ImageF gathered(const BlurFrame& frame, const Values& more = {}, int64_t samples = 3) {
    Values values = {{"samples", samples}, {"max_blur_px", int64_t(16)}};
    values.insert(values.end(), more.begin(), more.end());
    return blurred(plain_blur(values), frame);
}

// 9 x 3 pixels, one bright pixel at (4, 1), v = (4, 0) everywhere.
struct Spot : BlurFrame {
    Spot() : BlurFrame(9, 3) {
        set_gray(4, 1, 1);
        set_all_half_velocities(4, 0);
    }
};

// w_c = w_max, w_A = w_B = 1.
// Outer weight: cone(2, 1/4) + cone(2, 1/4) + 2 cylinder(2, 4) = 0.5 + 0.5 + 2 = 3.
// Center weight: 1 + 1 + 2 = 4. total = 3 / (40 * 4) = 0.01875. Sum of weights 10.01875.
TEST(Gather, UniformMotion) {
    Spot frame;
    const ImageF out = gathered(frame);
    expect_pixel(out, 4, 1, {1 - 6 / 10.01875});
    expect_pixel(out, 2, 1, {3 / 10.01875});
    expect_pixel(out, 6, 1, {3 / 10.01875});
    expect_pixel(out, 3, 1, {0}, 0);  // T = 2 steps over the spot
    expect_pixel(out, 2, 0, {0}, 0);
}

// A bright pixel at the middle of each border, towards which everything moves.
TEST(Gather, BorderSkipsOrClamps) {
    for (const bool rows : {false, true})
        for (const bool far : {false, true}) {
            SCOPED_TRACE(rows ? far ? "bottom" : "top" : far ? "right" : "left");
            BlurFrame frame(rows ? 3 : 9, rows ? 9 : 3);
            frame.set_all_half_velocities(rows ? 0 : 4, rows ? 4 : 0);
            // The pixel so many pixels away from the border.
            const auto at = [&](int distance) {
                const int along = far ? 8 - distance : distance;
                return std::pair(rows ? 1 : along, rows ? along : 1);
            };
            const auto expect = [&](const ImageF& image, int distance, double value) {
                const auto [x, y] = at(distance);
                expect_pixel(image, x, y, {value});
            };
            const auto [x, y] = at(0);
            frame.set_gray(x, y, 1);
            const ImageF skipped = gathered(frame);
            const ImageF clamped = gathered(frame, {{"border", "clamp"}});
            // 1 px away: the outer tap lies 1 px beyond the border. skip: center 4 and inner tap 3,
            // both dark. clamp: the outer tap moves to the bright pixel.
            expect(skipped, 1, 0);
            expect(clamped, 1, 3 / 10.01875);
            // The bright pixel: skip loses the outer tap, clamp moves it to the pixel itself.
            expect(skipped, 0, 1 - 3 / 7.01875);
            expect(clamped, 0, 1 - 3 / 10.01875);
            for (const char* border : {"skip", "clamp"})
                expect_reference(plain_blur({{"samples", int64_t(3)},
                                             {"max_blur_px", int64_t(16)},
                                             {"border", border}}),
                                 frame, 0);
        }
}

TEST(Gather, DepthByHand) {
    Spot frame;
    frame.depth().at(4, 1) = 2;  // the spot is closer: w = 2 against 1
    ImageF out = gathered(frame);
    // At the spot, p is closer: f = clamp(1 - (2 - 1)) = 0, b = 1: outer weight 0.5 + 2 = 2.5.
    expect_pixel(out, 4, 1, {1 - 5 / 9.01875});
    // At (2, 1), S is the spot: f = 1, b = 0: 2.5 again; its other tap 3, center 4.
    expect_pixel(out, 2, 1, {2.5 / 9.51875});
    // Ratio 1.5, s = 1: the cone behind halves: at the spot f = 0.5: 0.25 + 0.5 + 2 = 2.75.
    frame.depth().at(4, 1) = 1.5;
    out = gathered(frame);
    expect_pixel(out, 4, 1, {1 - 5.5 / 9.51875});
    // s = 20: 0 again. s = 0: depth is ignored.
    out = gathered(frame, {{"depth_softness", 20.0}});
    expect_pixel(out, 4, 1, {1 - 5 / 9.01875});
    out = gathered(frame, {{"depth_softness", 0.0}});
    expect_pixel(out, 4, 1, {1 - 6 / 10.01875});
    // Sky: q = 0 everywhere is equal depth; the spot against sky: f = 0, b = 1 at the spot.
    for (float& q : frame.depth().data) q = 0;
    expect_pixel(gathered(frame), 4, 1, {1 - 6 / 10.01875});
    frame.depth().at(4, 1) = 1e-10f;
    out = gathered(frame);
    expect_pixel(out, 4, 1, {1 - 5 / 9.01875});
    expect_pixel(out, 2, 1, {2.5 / 9.51875});
    out = gathered(frame, {{"depth_softness", 0.0}});
    expect_pixel(out, 4, 1, {1 - 6 / 10.01875});
}

// A still dark pixel at (4, 1); all others move (4, 0) and are white. w_max = (1, 0), w_c = w_p =
// (0, 1). Outer: f cone(2, 1/4) w_B = 0.5; b: w_A = 0; cylinder(2, 0.5) = 0. Center: v_S = 0, so
// w_B = 0 and w_A = 1: 0 + 1 + 2 = 3. total = 3 / (40 * 0.5) = 0.15.
TEST(Gather, StillPixelAmongMovers) {
    Spot frame;
    for (float& value : frame.color().data) value = 1;
    frame.set_gray(4, 1, 0);
    frame.set_half_velocity(4, 1, 0, 0);
    expect_pixel(gathered(frame), 4, 1, {1 / 4.15});
    // dominant: w_c = (1, 0): the center tap is the same; b cone(2, 2) = 0 still. The same image.
    expect_pixel(gathered(frame, {{"static_direction", "dominant"}}), 4, 1, {1 / 4.15});
    // kappa = 1: total = 3 / 0.5 = 6.
    expect_pixel(gathered(frame, {{"center_weight", 1.0}}), 4, 1, {1 / 10.0});
}

// As before, but (4, 1) has v = (1.25, 0): the share of its own direction is (1.25 - 0.5) / 1.5 =
// 0.5. w_p . v_c = 0: on either side w_c = normalize((0.5, +-0.5)), |w_c . w_max| = 0.70711. Outer:
// f cone(2, 1/4) = 0.5, b cone(2, 0.8) = 0, cylinder(2, 1.25) = 0. Center along w_c: w_A = 1, w_B =
// 0.70711: 0.70711 + 1 + 2. total = 3 / (40 * 1.25) = 0.06.
TEST(Gather, SlowPixelMixesDirections) {
    Spot frame;
    for (float& value : frame.color().data) value = 1;
    frame.set_gray(4, 1, 0);
    frame.set_half_velocity(4, 1, 1.25, 0);
    const double half = std::sqrt(0.5);
    expect_pixel(gathered(frame), 4, 1, {1 / (0.06 + 3 + half + 1)});
    // gamma = 0.01: fully its own direction: w_c = (1, 0); center 1 + 1 + 2.
    expect_pixel(gathered(frame, {{"variance_threshold_px", 0.01}}), 4, 1, {1 / (0.06 + 4 + 1)});
    // gamma = 100: share 0.0075: w_c = (0.0075, 0.9925) / 0.992528, w_B = 0.0075565.
    const double w_b = 0.0075 / std::sqrt(0.0075 * 0.0075 + 0.9925 * 0.9925);
    expect_pixel(gathered(frame, {{"variance_threshold_px", 100.0}}), 4, 1,
                 {1 / (0.06 + 3 + w_b + 1)});
}

// N = 5, |v_max| = 3: t = -2/3, -1/3, 0, 1/3, 2/3. (4, 4) has v = (1.25, 0), along v_max: taps 1
// and 3 are at T = 1 along w_c = (0.70711, +-0.70711), of both sides: (5, 5) and (3, 3), (5, 3) and
// (3, 5). f cone(1, 1/3) w_B = 2/3 0.70711, b cone(1, 0.8) = 0.2, 2 cylinder(1, 1.25) = 2. Taps 0
// and 4 along w_max at T = 2: 1/3. The center tap: 1 + 0.70711 + 2. total = 5 / (40 * 1.25) = 0.1.
// The mean of both sides: each corner has half of its weight.
TEST(Gather, SlowPixelAlongTheStreakTakesBothSides) {
    BlurFrame frame(9, 9);
    frame.set_all_half_velocities(3, 0);
    frame.set_half_velocity(4, 4, 1.25, 0);
    frame.color().at(5, 5, 0) = 1;
    frame.color().at(5, 3, 1) = 1;
    frame.color().at(3, 3, 2) = 1;
    const double half = std::sqrt(0.5), corner = 2.0 / 3 * half + 0.2 + 2;
    const double red = 0.5 * corner / (0.1 + 2 * corner + 2.0 / 3 + 3 + half);
    expect_pixel(gathered(frame, {}, 5), 4, 4, {red, red, red});
    // With static_direction: dominant, w_max replaces w_p across v_max: taps 1 and 3 are at the
    // same corners. The center tap now has w_B = 0: 0.70711 + 2 0.70711.
    frame.set_half_velocity(4, 4, 0, 1.25);
    const double across = 0.5 * corner / (0.1 + 2 * corner + 2.0 / 3 + 3 * half);
    expect_pixel(gathered(frame, {{"static_direction", "dominant"}}, 5), 4, 4,
                 {across, across, across});
}

// Slow pixels among fast ones of the same line lie on neither side of it; others on one of them.
TEST(Gather, ReferenceOfSlowPixels) {
    for (const char* direction : {"dominant", "perpendicular"})
        for (const int along : {0, 1, 2}) {
            BlurFrame frame = random_frame(61, 45, 4, 1.5f, 9);
            for (int y = 0; y < 45 && along < 2; ++y)
                for (int x = 0; x < 61; ++x) frame.motion().at(x, y, 1 - along) = 0;
            SCOPED_TRACE(concat(direction, " ", along));
            for (const double least : {0.0, 1.5}) {
                const Chain chain = plain_blur({{"max_blur_px", int64_t(8)},
                                                {"static_direction", direction},
                                                {"min_speed_px", least}});
                const auto found = stages_of(chain, frame);
                const auto expected = reference_stages_of(chain, frame);
                for (const char* stage : {"color", "hint"}) {
                    const Difference difference =
                        compare(found.at(stage), expected.at(stage), 1e-3);
                    EXPECT_LE(difference.fraction, 0.002) << stage << ": " << difference.text;
                }
            }
        }
}

// Two directions, N = 5: t = -2/3, -1/3, 0, 1/3, 2/3, |v_max| = 3. The center column moves (0, 2),
// all others (3, 0). At the center (4, 4): taps 1 and 3 go along w_c = (0, 1) to T = 1, S = (4, 3),
// (4, 5): cone(1, 1/2) = 0.5 twice, cylinder(1, 2) = 1: weight 3. Taps 0 and 4 along (1, 0) to T =
// 2: w_A = 0, w_B = 1: f cone(2, 1/3) = 1/3, 2 cylinder(2, 2) = 2 * 0.5: weight 4/3. The center tap
// is along w_max: w_A = w_B = 0: weight 0. total = 5 / (40 * 2) = 0.0625. Sum 8.729167.
TEST(Gather, TwoDirections) {
    BlurFrame frame(9, 9);
    frame.set_all_half_velocities(3, 0);
    for (int y = 0; y < 9; ++y) frame.set_half_velocity(4, y, 0, 2);
    frame.color().at(4, 5, 0) = 1;  // red along w_c, green along w_max
    frame.color().at(6, 4, 1) = 1;
    const double sum = 0.0625 + 6 + 8.0 / 3;
    expect_pixel(gathered(frame, {}, 5), 4, 4, {3 / sum, 4.0 / 3 / sum});
    // One tile: u = 0, so with sample_split variance all five taps lie along w_max: T = 1 too, S =
    // (3, 4) and (5, 4): f cone(1, 1/3) = 2/3, 2 cylinder(1, 2) = 2: weight 8/3 each.
    const double along = 0.0625 + 8.0 / 3 + 16.0 / 3;
    expect_pixel(gathered(frame, {{"sample_split", "variance"}}, 5), 4, 4, {0, 4.0 / 3 / along});
}

// Tiles of 4 px, the left column moving (0, 3), the right column (3, 0): u of each tile is 1 - (1 +
// 0) / 2 = 0.5, so also in between. floor((i + 1) / 2) > floor(i / 2) for odd i: an exact even
// split.
TEST(Gather, VarianceOfOneHalfIsTheEvenSplit) {
    BlurFrame frame(8, 4);
    frame.color() = noise_image(8, 4, 4, 3);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x) frame.set_half_velocity(x, y, x < 4 ? 0 : 3, x < 4 ? 3 : 0);
    const auto with = [&](const char* split) {
        return blurred(plain_blur({{"max_blur_px", int64_t(4)}, {"sample_split", split}}), frame);
    };
    EXPECT_TRUE(equal_bits(with("even"), with("variance")));
}

TEST(Hint, ByHand) {
    // Tiles of 6 px. Tiles 0 and 2 have one velocity each, tile 4 is mixed; 1 and 3 are still, but
    // their neighbors reach them, so only tile centers with a known sum are checked.
    const Values values = {
        {"samples", int64_t(3)}, {"max_blur_px", int64_t(6)}, {"variance_threshold_px", 0.01}};
    const auto hint_of = [&](double v, double v_center) {
        BlurFrame frame(6, 6);
        frame.set_all_half_velocities(v, 0);
        frame.set_half_velocity(3, 3, v_center, 0);
        const ImageF hint = stages_of(plain_blur(values), frame)["hint"];
        return std::pair(hint.at(3, 3, 0), hint.at(3, 3, 1));
    };
    using Gates = std::pair<float, float>;
    EXPECT_EQ(hint_of(0, 0), Gates(0, 0));
    EXPECT_EQ(hint_of(0.5, 0.5), Gates(0, 0));  // not above min_speed_px
    // v = 0.6, uniform: T = 0.3, outer weights 0.5 + 0.5 + 2 = 3, sum 10 + 3 / 24. Second moment
    // 6 * 0.09 / 10.125 = 0.0533: streak sqrt(3 * 0.0533) = 0.4 px.
    EXPECT_EQ(hint_of(0.6, 0.6), Gates(1, 0));
    // v = 0.8: T = 0.4: 6 * 0.16 / 10.09 = 0.0951: 0.534 px.
    EXPECT_EQ(hint_of(0.8, 0.8), Gates(1, 1));
    // A still pixel among moving ones (weights of StillPixelAmongMovers): T = 2: 4 / 4.15: 1.7 px.
    EXPECT_EQ(hint_of(4, 0), Gates(1, 1));
    // A still pixel on still ground in a moving tile: only its own tap counts.
    BlurFrame frame(6, 6);
    frame.set_half_velocity(0, 0, 4, 0);
    const ImageF hint = stages_of(plain_blur(values), frame)["hint"];
    expect_pixel(hint, 5, 5, {1, 0}, 0);
}

// The two jitters against pixels computed by hand, with Halton's numbers for seed 0: the index
// interleaves the bits of x (even positions) and y (odd positions); the tile value mirrors it at
// the binary point, the tap value is 2 * (mirrored in base 3) - 1.

// Four tiles of 4 px in a row; only the last moves. NeighborMax is 0 in tiles 0 and 1 and (3, 0) in
// 2 and 3; only the hint's first gate shows which tile a pixel used. Slope 0.5: probability 0.5 -
// e/2.
TEST(TileJitter, ByHand) {
    BlurFrame frame(16, 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 12; x < 16; ++x) frame.set_half_velocity(x, y, 3, 0);
    const ImageF hint =
        stages_of(blur({{"max_blur_px", int64_t(4)}, {"tile_jitter_slope", 0.5}, {"jitter", 0.0}}),
                  frame)["hint"];
    // (6, 2): local (0.625, 0.625), both axes at e = 0.375: x is used; right neighbor with
    // probability 0.3125. Index 011100b = 28, mirrored 0.00111b = 0.21875: uses tile 2.
    EXPECT_EQ(hint.at(6, 2, 0), 1);
    // (6, 1): local y 0.375, e = 0.375 again. Index 10110b, mirrored 0.01101b = 0.40625: stays.
    EXPECT_EQ(hint.at(6, 1, 0), 0);
    // (7, 1): e = 0.125, probability 0.4375. Odd x: first digit 1, at least 0.5: stays.
    EXPECT_EQ(hint.at(7, 1, 0), 0);
    // (6, 0): the top is closer (0.125 < 0.375): index 10100b, mirrored 0.00101b = 0.156 < 0.4375,
    // but no tile exists above: stays.
    EXPECT_EQ(hint.at(6, 0, 0), 0);
    // (8, 1): local x 0.125, left neighbor with probability 0.4375. Index 1000010b, mirrored
    // 0.0100001b = 0.2578: uses tile 1, which is still.
    EXPECT_EQ(hint.at(8, 1, 0), 0);
    // (9, 1): odd x: stays in its moving tile. (12, 1): index 01011 0010b ... its left neighbor is
    // tile 2, which moves as well.
    EXPECT_EQ(hint.at(9, 1, 0), 1);
    EXPECT_EQ(hint.at(12, 1, 0), 1);
}

// N = 1: t = j h. Uniform (4, 0), h = 0.75; at (1, 0): index 1, base 3: 1/3, j = -1/3, t = -0.25:
// T = 1, S = (0, 0). Weight 0.75 + 0.75 + 2 = 3.5, total 1 / 160.
TEST(TapJitter, ByHand) {
    BlurFrame frame(5, 2);
    frame.set_all_half_velocities(4, 0);
    for (int x = 0; x < 5; ++x)
        for (int y = 0; y < 2; ++y) frame.set_gray(x, y, float(1 << x));
    const ImageF out =
        blurred(blur({{"samples", int64_t(1)}, {"jitter", 0.75}, {"tile_jitter", false}}), frame);
    expect_pixel(out, 1, 0, {2 + 3.5 * (1 - 2) / 3.50625});
    // (0, 1): index 2, 2/3, j = 1/3: S = (1, 1).
    expect_pixel(out, 0, 1, {1 + 3.5 * (2 - 1) / 3.50625});
    // (1, 1): index 3, 1/9, j = -7/9, t = -7/12: T = 7/3, S = (-1, 1), skipped.
    expect_pixel(out, 1, 1, {2});
    // (2, 0): index 4, 4/9, j = -1/9: T = 1/3, S = p.
    expect_pixel(out, 2, 0, {4});
    // (2, 1): index 6 = 20 in base 3, 0.02 = 2/9, j = -5/9, t = -5/12: T = 5/3, S = (0, 1):
    // cone(5/3, 1/4) = 7/12 twice, + 2: 19/6.
    expect_pixel(out, 2, 1, {4 + 19.0 / 6 * (1 - 4) / (19.0 / 6 + 0.00625)});
}

}  // namespace
}  // namespace postchain::test
