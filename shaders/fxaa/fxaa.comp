#version 450 core
// FXAA, stage "fxaa".
//
//   color [, luma] [, hint] --> color
//
// LUMA_PLANE 0: lumas are computed here (LUMA_DISPLAY). 1: by luma.comp.
// LAYERS: number of extra layers
// DIRECTIONAL 0: mode: search. 1: mode: directional. HINT 0: none. 1: checkerboard. 2: threshold.
// BLURRED 1: where: blurred. 2: likewise, without a hint. LIST: only the blocks of a work list
#include "common/layers.glsl"
#include "common/work_list.glsl"
#include "shared/fxaa_uniforms.h"
#include "fxaa/gate.glsl"
#include "fxaa/blend.glsl"
#if LUMA_PLANE
#include "fxaa/transparency.glsl"
#else
#include "fxaa/luma.glsl"
#endif

layout(binding = 0) uniform sampler2D color_plane;
#if LUMA_PLANE
layout(binding = 1) uniform sampler2D luma_plane;
#endif
layout(binding = 0) writeonly uniform image2D result_plane;
#ifdef LAYERS
layout(binding = 3) uniform sampler2DArray layers;
layout(binding = 1) writeonly uniform image2DArray layers_result;
#endif

// F^2 of a luma (x + y) & 1: |A|/range = 2/3, F = 4/9 (3 - 4/3) = 20/27.
const float kCheckerboardOffset = 400.0 / 729.0;

// The least range of lumas between `lowest` and `highest` around a pixel that is an edge, with both
// thresholds scaled. Never 0: if all lumas are nearly 1, a smaller range is rounding.
float least_range(float lowest, float highest, vec4 center, float threshold_scale) {
    precise const float brightest = highest + transparency(center);
    precise const float threshold = max(uniforms.edge_threshold_min * threshold_scale,
                                        brightest * (uniforms.edge_threshold * threshold_scale));
    return max(threshold, 1e-4 * max(1.0, max(abs(lowest), abs(highest))));
}

ivec2 inside(ivec2 p) {
    return clamp(p, ivec2(0), uniforms.size - 1);
}

vec4 color_at(ivec2 p) {
    return finite_color(texelFetch(color_plane, inside(p), 0));
}

float luma_at(ivec2 p) {
#if LUMA_PLANE
    return texelFetch(luma_plane, inside(p), 0).x;
#else
    return luma_of(color_at(p));
#endif
}

// A GPU keeps the lumas of a work group's pixels, and of those around it, in the group's memory.
#ifdef SOFTWARE_RENDERER
void load_lumas(ivec2 block) {}

// The luma at an offset of at most kLumaReachPx along each axis from this invocation's pixel p.
float luma_beside(ivec2 p, ivec2 offset) {
    return luma_at(p + offset);
}
#else
const int kLumaReachPx = DIRECTIONAL == 1 ? 2 : 1;
const int kLumaEdge = kBlockPx + 2 * kLumaReachPx;
shared float lumas[kLumaEdge * kLumaEdge];

void load_lumas(ivec2 block) {
    const ivec2 first = kBlockPx * block - kLumaReachPx;
    for (int i = int(gl_LocalInvocationIndex); i < kLumaEdge * kLumaEdge; i += kBlockPx * kBlockPx)
        lumas[i] = luma_at(first + ivec2(i % kLumaEdge, i / kLumaEdge));
    barrier();
}

float luma_beside(ivec2 p, ivec2 offset) {
    const ivec2 place = p % kBlockPx + kLumaReachPx + offset;
    return lumas[place.y * kLumaEdge + place.x];
}
#endif

#if DIRECTIONAL
#include "fxaa/directional.glsl"
#else
#include "fxaa/search.glsl"
#endif

vec4 filtered_with_hint(ivec2 p, vec4 center, float hint) {
#ifdef LAYERS
    for (int i = 0; i < 9; ++i) shares[i] = 0.0;
#endif
#if HINT == 1
    // Shortcut of the checkerboard: two taps at any luma; a hint between 0 and 1 lies between the
    // plain filter and the two taps.
    const vec4 taps =
        blend(center, color_at(p + ivec2(0, -1)), kCheckerboardOffset * uniforms.subpix);
#ifdef LAYERS
    const vec4 plain = filtered(p, center, 1.0);
    const float taps_share = hint >= 1.0 ? 1.0 : share_of(plain, taps, hint);
    precise const float plain_share = 1.0 - taps_share;
    for (int i = 0; i < 9; ++i) shares[i] *= plain_share;
    const int above = place_of(inside(p + ivec2(0, -1)) - p);
    precise const float of_above =
        shares[above] + taps_share * share_of(center, color_at(p + ivec2(0, -1)),
                                              kCheckerboardOffset * uniforms.subpix);
    shares[above] = of_above;
    return hint >= 1.0 ? taps : blend(plain, taps, hint);
#else
    return hint >= 1.0 ? taps : blend(filtered(p, center, 1.0), taps, hint);
#endif
#elif HINT == 2
    // Where the gate mixes, it needs no threshold besides.
    precise const float scale = BLURRED > 0 ? 0.0 : 1.0 - hint;
    return filtered(p, center, scale);
#else
    return filtered(p, center, 1.0);
#endif
}

vec4 result_at(ivec2 p) {
    const vec4 center = color_at(p);
#if BLURRED
    const float hint = hint_at(p);
    const vec4 all = filtered_with_hint(p, center, hint);
#ifdef LAYERS
    for (int i = 0; i < 9; ++i) shares[i] *= hint;
#endif
    precise const vec4 part = center + hint * (all - center);
    return hint < 1.0 ? part : all;
#else
    return filtered_with_hint(p, center, hint_at(p));
#endif
}

#ifdef LAYERS
void store_layers(ivec2 p) {
    vec4 centers[LAYERS];
    precise vec4 sums[LAYERS];
    FOR_LAYERS(l) {
        centers[l] = LAYER_FETCH(layers, p, l);
        sums[l] = vec4(0.0);
    }
    bool mixes = false;
    for (int i = 0; i < 9; ++i) {
        if (i == 4 || shares[i] == 0.0) continue;
        mixes = true;
        const ivec2 at = p + ivec2(i % 3, i / 3) - 1;
        FOR_LAYERS(l) sums[l] += shares[i] * (LAYER_FETCH(layers, at, l) - centers[l]);
    }
    // -0 + 0 is 0: without a share no bit may change.
    FOR_LAYERS(l) LAYER_STORE(layers_result, p, l, mixes ? centers[l] + sums[l] : centers[l]);
}
#endif

void main() {
    ivec2 p;
    const bool is_pixel = next_pixel(uniforms.size, p);
    load_lumas(p / kBlockPx);
    if (!is_pixel) return;
    const vec4 result = result_at(p);
    STORE(result_plane, p, result);
#ifdef LAYERS
    store_layers(p);
#endif
}
