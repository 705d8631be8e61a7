#version 450 core
// c (1 - strength t), t = squared distance from the center over that of the corners.
//
//   color [, layers] -> color [, layers]
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/precise.glsl"
#include "common/work_group.glsl"
#include "shared/vignette_uniforms.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D darkened;
#ifdef LAYERS
layout(binding = 1) uniform sampler2DArray layers;
layout(binding = 1) writeonly uniform image2DArray layers_darkened;
#endif

vec4 darker(vec4 c, float kept) {
    return vec4(c.rgb * kept, uniforms.alpha != 0 ? c.a * kept : c.a);
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const vec2 from_center = vec2(2 * p + 1 - uniforms.size);  // half pixels
    const vec2 corner = vec2(uniforms.size);
    const float t = precise_dot(from_center, from_center) / precise_dot(corner, corner);
    const float kept = 1.0 - uniforms.strength * t;
    STORE(darkened, p, darker(finite_color(texelFetch(color, p, 0)), kept));
#ifdef LAYERS
    FOR_LAYERS(i) LAYER_STORE(layers_darkened, p, i, darker(LAYER_FETCH(layers, p, i), kept));
#endif
}
