// The place of a pixel's surface in a texture of two halves, one below the other: the frame before and
// the one after, if both are searched; this frame and the layer behind.
//
// LOWER: 1: this step does the lower half
#include "shared/inverse_warp_uniforms.h"

ivec2 in_half(ivec2 p) {
    return p + ivec2(0, LOWER * uniforms.size.y);
}
