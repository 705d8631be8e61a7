// Luma: one perceptual number per pixel that makes every decision.
//
// LUMA_DISPLAY 0: weights of the stored values (display-referred input).
// LUMA_DISPLAY 1: exposure, x/(1 + max(x)), square root per channel, then the weights
//                 (scene-linear input). Negatives are 0 before the root.
// A luma is always finite: NaN counts as 0, and all lumas are clamped to +-kMaxLuma, so that no sum
// of lumas overflows.
//
// Needs uniforms, is_nan().

const float kMaxLuma = 1e30;

float held(float x) {
    return is_nan(x) ? 0.0 : clamp(x, -kMaxLuma, kMaxLuma);
}

float luma_of(vec3 stored) {
    precise vec3 x = vec3(held(stored.r), held(stored.g), held(stored.b));
#if LUMA_DISPLAY
    x = clamp(x * uniforms.exposure, 0.0, kMaxLuma);
    x = sqrt(x / (1.0 + max(x.r, max(x.g, x.b))));
#endif
    precise float luma =
        x.r * uniforms.luma_weights.r + x.g * uniforms.luma_weights.g + x.b * uniforms.luma_weights.b;
    return luma;
}
