#version 450 core
// FXAA, stage "luma": one perceptual number per pixel, from which every decision is made.
//
//   color --> luma (r32f, whatever the chain's precision: the decisions compare differences)
//
// LUMA_DISPLAY 0: weights of the stored values (display-referred input).
// LUMA_DISPLAY 1: exposure, x/(1 + max(x)), square root per channel, then the weights
//                 (scene-linear input). Negatives are 0 before the root.
// A luma is always finite: NaN counts as 0, and everything is held to +-kLargest, so that no sum
// of lumas overflows.
#include "common/finite.glsl"
#include "common/work_group.glsl"
#include "shared/fxaa_block.h"

layout(binding = 0) uniform sampler2D color_plane;
layout(binding = 0) uniform writeonly image2D luma_plane;

const float kLargest = 1e30;

float held(float x) {
    return is_nan(x) ? 0.0 : clamp(x, -kLargest, kLargest);
}

void main() {
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, block.size))) return;

    const vec3 stored = texelFetch(color_plane, p, 0).rgb;
    precise vec3 x = vec3(held(stored.r), held(stored.g), held(stored.b));
#if LUMA_DISPLAY
    x = clamp(x * block.exposure, 0.0, kLargest);
    x = sqrt(x / (1.0 + max(x.r, max(x.g, x.b))));
#endif
    precise float luma =
        x.r * block.luma_weights.r + x.g * block.luma_weights.g + x.b * block.luma_weights.b;
    imageStore(luma_plane, p, vec4(luma, 0.0, 0.0, 0.0));
}
