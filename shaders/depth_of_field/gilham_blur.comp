#version 450 core
// One direction of the separable Gaussian on the downsampled image; STEP is ivec2(1, 0) or ivec2(0,
// 1). Out-of-bounds taps do not count. LEAK_DEPTH: a neighbor clearly in front of the pixel, w_n >
// 1.02 w_p, does not count. LEAK_COC: the weight of a neighbor is multiplied by clamp(|R_n|/|R_p|,
// 0, 1); 1 where |R_p| is 0. LAYERS: number of extra layers.
#include "common/layers.glsl"
#include "common/work_list.glsl"
#include "shared/depth_of_field_blur_uniforms.h"

layout(binding = 0) uniform sampler2D source;
#if defined(LEAK_DEPTH) || defined(LEAK_COC)
layout(binding = 1) uniform sampler2D guide;
#endif
layout(binding = 0) writeonly uniform image2D blurred;
#ifdef LAYERS
layout(binding = 2) uniform sampler2DArray source_layers;
layout(binding = 1) writeonly uniform image2DArray blurred_layers;
#endif

vec4 center;
float center_guide;
vec4 sum = vec4(0.0);   // sum of weight (neighbor - center): exact if all are equal
float total = 1.0;      // sum of weights; the center weighs 1
#ifdef LAYERS
vec4 layer_centers[LAYERS], layer_sums[LAYERS];
#endif

void tap(ivec2 p, int offset, float weight) {
    ivec2 q = p + STEP * offset;
    ivec2 inside = clamp(q, ivec2(0), uniforms.size - 1);
    weight = q == inside ? weight : 0.0;
#if defined(LEAK_DEPTH)
    weight = texelFetch(guide, inside, 0).x > 1.02 * center_guide ? 0.0 : weight;
#elif defined(LEAK_COC)
    float neighbor = texelFetch(guide, inside, 0).x;
    weight *= neighbor < center_guide ? neighbor / center_guide : 1.0;
#endif
    precise const vec4 next = sum + weight * (texelFetch(source, inside, 0) - center);
    sum = next;
#ifdef LAYERS
    FOR_LAYERS(i) {
        precise const vec4 layer =
            layer_sums[i] + weight * (LAYER_FETCH(source_layers, inside, i) - layer_centers[i]);
        layer_sums[i] = layer;
    }
#endif
    precise const float weights = total + weight;
    total = weights;
}

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
    center = texelFetch(source, p, 0);
#ifdef LAYERS
    FOR_LAYERS(i) {
        layer_centers[i] = LAYER_FETCH(source_layers, p, i);
        layer_sums[i] = vec4(0.0);
    }
#endif
#if defined(LEAK_DEPTH) || defined(LEAK_COC)
    center_guide = texelFetch(guide, p, 0).x;
#endif
    for (int quad = 0; quad < uniforms.quads; ++quad) {
        vec4 weights = uniforms.weights[quad];
        int offset = 4 * quad + 1;
        tap(p, offset, weights.x);
        tap(p, -offset, weights.x);
        tap(p, offset + 1, weights.y);
        tap(p, -offset - 1, weights.y);
        tap(p, offset + 2, weights.z);
        tap(p, -offset - 2, weights.z);
        tap(p, offset + 3, weights.w);
        tap(p, -offset - 3, weights.w);
    }
    STORE(blurred, p, center + sum / total);
#ifdef LAYERS
    FOR_LAYERS(i) LAYER_STORE(blurred_layers, p, i, layer_centers[i] + layer_sums[i] / total);
#endif
}
