#version 450 core
// out = mix(sharp, bilinear(low), smoothstep(0.5, full_blur_px, |R|)), where low is the blurred
// image at 1/FACTOR of the size. If the weight is 0 the pixel returns bit for bit; if it is 1, only
// the blurred image shows. In blocks known to be SHARP (|R| <= 0.5) low is not read, in BLURRED
// blocks (|R| >= full_blur_px) color and coc are not. LAYERS: number of extra layers. WITH_HINT:
// FXAA's hint, multiplied by clamp(1 - |R|, 0, 1): the edges it marks are blurred away.
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_list.glsl"
#include "shared/depth_of_field_uniforms.h"
#include "shared/sharp_radius.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D coc;
layout(binding = 2) uniform sampler2D low;
layout(binding = 0) writeonly uniform image2D result;
#ifdef WITH_HINT
layout(binding = 3) uniform sampler2D hint;
layout(binding = 1) writeonly uniform image2D hint_result;
#endif
#ifdef LAYERS
layout(binding = 4) uniform sampler2DArray layers;
layout(binding = 5) uniform sampler2DArray low_layers;
layout(binding = 2) writeonly uniform image2DArray layers_result;
#endif

// a + t (b - a) and not mix(): exact if a and b are equal.
vec4 between(vec4 a, vec4 b, float t) {
    precise vec4 c = a + t * (b - a);
    return c;
}

// Bilinear by hand at (p + 0.5)/FACTOR - 0.5, clamped: hardware filtering rounds its weights to
// 8 bits.
vec4 fetch_low(ivec2 p) {
#if FACTOR == 1
    return texelFetch(low, p, 0);
#else
    precise vec2 position = max((vec2(p) + 0.5) / float(FACTOR) - 0.5, 0.0);
    ivec2 a = ivec2(position);  // at most low_size - 1; beyond the last center a = b
    ivec2 b = min(a + 1, uniforms.low_size - 1);
    precise vec2 t = position - vec2(a);
    vec4 top = between(texelFetch(low, a, 0), texelFetch(low, ivec2(b.x, a.y), 0), t.x);
    vec4 bottom = between(texelFetch(low, ivec2(a.x, b.y), 0), texelFetch(low, b, 0), t.x);
    return between(top, bottom, t.y);
#endif
}

#ifdef LAYERS
vec4 fetch_low_layer(ivec2 p, int i) {
#if FACTOR == 1
    return LAYER_FETCH(low_layers, p, i);
#else
    precise const vec2 position = max((vec2(p) + 0.5) / float(FACTOR) - 0.5, 0.0);
    const ivec2 a = ivec2(position);
    const ivec2 b = min(a + 1, uniforms.low_size - 1);
    precise const vec2 t = position - vec2(a);
    const vec4 top = between(LAYER_FETCH(low_layers, a, i),
                             LAYER_FETCH(low_layers, ivec2(b.x, a.y), i), t.x);
    const vec4 bottom = between(LAYER_FETCH(low_layers, ivec2(a.x, b.y), i),
                                LAYER_FETCH(low_layers, b, i), t.x);
    return between(top, bottom, t.y);
#endif
}
#endif

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
#ifdef BLURRED
    STORE(result, p, fetch_low(p));
#ifdef LAYERS
    FOR_LAYERS(i) LAYER_STORE(layers_result, p, i, fetch_low_layer(p, i));
#endif
#else
#if !defined(SHARP) || defined(WITH_HINT)
    float radius = abs(texelFetch(coc, p, 0).x);
#endif
    vec4 c = finite_color(texelFetch(color, p, 0));
    // The weight of the blurred image.
    precise float blurred_part = 0.0;
#ifndef SHARP
    if (radius > kSharpRadiusPx) {
        vec4 blurred = fetch_low(p);
        if (radius >= uniforms.full_blur_px) {
            c = blurred;
            blurred_part = 1.0;
        } else {
            float t = (radius - kSharpRadiusPx) / (uniforms.full_blur_px - kSharpRadiusPx);
            blurred_part = t * t * (3.0 - 2.0 * t);
            c = between(c, blurred, blurred_part);
        }
    }
#endif
    STORE(result, p, c);
#ifdef LAYERS
    FOR_LAYERS(i) {
        vec4 layer = LAYER_FETCH(layers, p, i);
#ifndef SHARP
        if (blurred_part == 1.0)
            layer = fetch_low_layer(p, i);
        else if (blurred_part > 0.0)
            layer = between(layer, fetch_low_layer(p, i), blurred_part);
#endif
        LAYER_STORE(layers_result, p, i, layer);
    }
#endif
#endif
#ifdef WITH_HINT
#ifdef BLURRED
    vec2 gate = vec2(0.0);
#else
    precise vec2 gate = texelFetch(hint, p, 0).xy * clamp(1.0 - radius, 0.0, 1.0);
#endif
    STORE(hint_result, p, vec4(gate, 0.0, 0.0));
#endif
}
