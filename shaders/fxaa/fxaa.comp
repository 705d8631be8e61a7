#version 450 core
// FXAA, stage "fxaa".
//
//   color, luma [, hint] --> color
//
// DIRECTIONAL 0: mode: search. 1: mode: directional.
// HINT 0: none. 1: checkerboard. 2: threshold.
#include "common/work_group.glsl"
#include "shared/fxaa_block.h"
#include "fxaa/blend.glsl"

layout(binding = 0) uniform sampler2D color_plane;
layout(binding = 1) uniform sampler2D luma_plane;
#if HINT
layout(binding = 2) uniform sampler2D hint_plane;
#endif
layout(binding = 0) uniform writeonly image2D result_plane;

// F^2 of a luma (x + y) & 1: |A|/range = 2/3, F = 4/9 (3 - 4/3) = 20/27.
const float kCheckerboardOffset = 400.0 / 729.0;

// The least range of lumas between `lowest` and `highest` that is an edge, whatever the thresholds:
// less is rounding, where all of them are nearly 1.
float least_range(float lowest, float highest) {
    return 1e-4 * max(1.0, max(abs(lowest), abs(highest)));
}

ivec2 inside(ivec2 p) {
    return clamp(p, ivec2(0), block.size - 1);
}

float luma_at(int x, int y) {
    return texelFetch(luma_plane, ivec2(x, y), 0).r;
}

vec4 color_at(ivec2 p) {
    return texelFetch(color_plane, inside(p), 0);
}

#if DIRECTIONAL
#include "fxaa/directional.glsl"
#else
#include "fxaa/search.glsl"
#endif

void main() {
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, block.size))) return;

    const vec4 center = color_at(p);
    vec4 result;
#if HINT
    const vec2 gates = texelFetch(hint_plane, p, 0).xy;
    float hint = block.hint_gate == 0 ? gates.x : gates.y;
    hint = hint > 0.0 ? min(hint, 1.0) : 0.0;  // NaN is no hint
#endif
#if HINT == 1
    // Short cut of the checkerboard: two taps, whatever the luma; a hint between 0 and 1 lies
    // between the plain filter and the two taps.
    const vec4 taps =
        blend(center, color_at(p + ivec2(0, -1)), kCheckerboardOffset * block.subpix);
    result = hint >= 1.0 ? taps : blend(filtered(p, center, 1.0), taps, hint);
#elif HINT == 2
    result = filtered(p, center, 1.0 - hint);
#else
    result = filtered(p, center, 1.0);
#endif
    imageStore(result_plane, p, result);
}
