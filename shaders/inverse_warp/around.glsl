// The four pixels adjacent to a pixel.
#include "shared/inverse_warp_uniforms.h"

const ivec2 kAround[4] = ivec2[4](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

bool inside(ivec2 p) {
    return all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, uniforms.size));
}
