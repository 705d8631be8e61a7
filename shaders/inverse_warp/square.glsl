// A thread for each square of 4 x 4 pixels, in work groups of kBlockPx x kBlockPx squares. What only
// some pixels need is done in a loop over their bits: a device that runs threads in step waits for
// the busiest of them, not for all pixels.
#include "common/work_group.glsl"
#include "shared/inverse_warp_uniforms.h"

const int kSquarePx = INVERSE_WARP_SQUARE_PX;

// Pixel i of the square: the place of its bit.
ivec2 pixel_of(ivec2 square, int i) {
    return kSquarePx * square + ivec2(i & 3, i >> 2);
}

uint bit_of(ivec2 p) {
    return 1u << ((p.y & 3) << 2 | (p.x & 3));
}

bool is_square(ivec2 square) {
    return all(greaterThanEqual(square, ivec2(0))) &&
           all(lessThan(kSquarePx * square, uniforms.size));
}

// The pixel of the lowest bit, which is cleared. None: the first pixel.
ivec2 next_pixel_of(ivec2 square, inout uint bits) {
    const int i = bits == 0u ? 0 : findLSB(bits);
    bits &= bits - 1u;
    return pixel_of(square, i);
}

// Shift of two bits of each pixel: an index of kAround.
int shift_of_direction(ivec2 p) {
    return 2 * ((p.y & 3) << 2 | (p.x & 3));
}
