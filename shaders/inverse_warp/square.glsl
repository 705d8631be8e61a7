// Squares of 4 x 4 pixels; a work group does 16 x 16 of them. Work that few pixels need is listed for
// the whole group and shared out among its threads: a device that runs threads in step waits for the
// busiest of them. The order of a list changes from run to run; no pixel may depend on it.
//
// A GPU has a thread for each square: the lists limit how many groups run at a time. On a software renderer
// a thread does four squares, for most work is in lists, unless DENSE is defined.
#include "shared/inverse_warp_uniforms.h"
#include "shared/work_group.h"

#if defined(DENSE) || !defined(SOFTWARE_RENDERER)
const int kEdgeThreads = kBlockPx;
layout(local_size_x = kBlockPx, local_size_y = kBlockPx) in;
#else
const int kEdgeThreads = kBlockPx / 2;
layout(local_size_x = kBlockPx / 2, local_size_y = kBlockPx / 2) in;
#endif

#include "common/first_group.glsl"
#include "common/software_loop.glsl"

const int kSquarePx = INVERSE_WARP_SQUARE_PX;
const int kThreads = kEdgeThreads * kEdgeThreads;
const int kSquares = kBlockPx * kBlockPx;  // of a work group

// Square i of the work group.
ivec2 square_of(int i) {
    return kBlockPx * group_at() + ivec2(i % kBlockPx, i / kBlockPx);
}

bool is_square(ivec2 square) {
    return all(greaterThanEqual(square, ivec2(0))) &&
           all(lessThan(kSquarePx * square, uniforms.size));
}

// The number of a pixel in its square, and the place of its bit:
//
//    0  1  2  3
//    4  5  6  7
//    8  9 10 11
//   12 13 14 15
int number_of(ivec2 p) {
    return (p.y & 3) << 2 | (p.x & 3);
}

uint bit_of(ivec2 p) {
    return 1u << number_of(p);
}

// An item of `list` is a pixel of the work group. Steps may use the upper bits.
//
//    31       12 11             4 3   2 1   0
//   +-----------+----------------+-----+-----+
//   |     0     | square         |  y  |  x  |
//   +-----------+----------------+-----+-----+
const int kItemBits = 12;
const uint kItem = (1u << kItemBits) - 1u;
shared uint list_length;
shared uint list[16 * kSquares];

// Begins a list. The work group calls it together, and then barrier() once all bits are listed.
void begin_list() {
    if (gl_LocalInvocationIndex == 0u) list_length = 0u;
    barrier();
}

// Lists the lower 16 of the bits of square k: the list has room for no more, whatever they come from.
void add_to_list(int k, uint bits) {
    bits &= 0xffffu;
    uint at = atomicAdd(list_length, uint(bitCount(bits)));
    if (bits != 0u) SOFTWARE_LOOP do {
        list[at] = uint(k << 4 | findLSB(bits));
        bits &= bits - 1u;
        ++at;
    } while (bits != 0u);
}

int square_of_item(uint item) {
    return int(item >> 4);
}

ivec2 pixel_of(uint item) {
    return kSquarePx * square_of(square_of_item(item)) + ivec2(item & 3u, item >> 2 & 3u);
}
