// Luma: one perceptual number per pixel that makes every decision.
//
// LUMA_DISPLAY 0: weights of the stored values (display-referred input).
// LUMA_DISPLAY 1: exposure, x/(1 + max(x)), square root per channel, then the weights
//                 (scene-linear input). Negatives are 0 before the root.
// All values are clamped to +-kMaxLuma, so that no sum of lumas overflows.
// Less the transparency, so that a black object on clear has edges; an opaque image does not change.
//
// Needs uniforms.
#include "fxaa/transparency.glsl"

const float kMaxLuma = 1e30;

float luma_of(vec4 stored) {
    precise vec3 x = clamp(stored.rgb, -kMaxLuma, kMaxLuma);
#if LUMA_DISPLAY
    x = clamp(x * uniforms.exposure, 0.0, kMaxLuma);
    x = sqrt(x / (1.0 + max(x.r, max(x.g, x.b))));
#endif
    precise float luma =
        x.r * uniforms.luma_weights.r + x.g * uniforms.luma_weights.g + x.b * uniforms.luma_weights.b;
    precise const float seen = luma - transparency(stored);
    return seen;
}
