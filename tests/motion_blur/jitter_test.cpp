// The two jitters against pixels computed by hand, with Halton's numbers for seed 0: the index
// interleaves the bits of x (even positions) and y (odd positions); the tile value mirrors it at
// the binary point, the tap value is 2 * (mirrored in base 3) - 1.

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

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
