#version 450 core
// Lays the object that was held out of a pass over its result (docs/layers.md): with m the matte, g
// the ground (1 - m of a pixel), F the filter, out = F(g)/F(1 - m) (1 - m) + c - g.
//
//   color, mattes, filtered, held, filtered_held [, layers] -> color [, layers]
//
// MATTE: index of the pass's matte    LAYERS: defined if the frame has layers, however many
#include "common/finite.glsl"
#include "common/matte.glsl"
#include "common/work_group.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2DArray mattes;
layout(binding = 2) uniform sampler2D filtered;
layout(binding = 3) uniform sampler2DArray held;
layout(binding = 4) uniform sampler2DArray filtered_held;
layout(binding = 0) writeonly uniform image2D result;
#ifdef LAYERS
layout(binding = 5) uniform sampler2DArray layers;
layout(binding = 1) writeonly uniform image2DArray layers_result;
#endif

// If less ground than this is visible, the pixel's own color takes its place.
const float kMinCoverage = 1.0 / 32.0;

// c: unfiltered; c_held, c_filtered: without the object, before and after the pass.
vec4 laid_over(vec4 c, vec4 c_held, vec4 c_filtered, float m, float kept, float coverage) {
    // The filter changed nothing here: no bit may change.
    if (m >= 1.0 || (c_held == c_filtered && coverage == kept)) return c;
    const float trust = clamp(coverage / kMinCoverage, 0.0, 1.0);
    const vec4 behind = coverage > 0.0 ? c_filtered / coverage : vec4(0.0);
    precise const vec4 over = c + trust * (kept * behind - c_held);
    return over;
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const float m = matte_at(p);
    precise const float kept = 1.0 - m;
    const float coverage = texelFetch(filtered_held, ivec3(p, 1), 0).x;
    // The object is not near: as without a matte.
    const bool plain = m == 0.0 && coverage == 1.0;
    vec4 out_color = texelFetch(filtered, p, 0);
    if (!plain)
        out_color = laid_over(finite_color(texelFetch(color, p, 0)),
                              texelFetch(held, ivec3(p, 0), 0),
                              texelFetch(filtered_held, ivec3(p, 0), 0), m, kept, coverage);
    imageStore(result, p, out_color);
#ifdef LAYERS
    for (int i = 0; i < textureSize(layers, 0).z; ++i) {
        vec4 layer = texelFetch(filtered_held, ivec3(p, i + 2), 0);
        if (!plain)
            layer = laid_over(texelFetch(layers, ivec3(p, i), 0),
                              texelFetch(held, ivec3(p, i + 2), 0), layer, m, kept, coverage);
        imageStore(layers_result, ivec3(p, i), layer);
    }
#endif
}
