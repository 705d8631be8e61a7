// Signed radius of the circle of confusion in pixels, from the inverse depth w; the uniform block
// has its members. Equations: passes/common/circle_of_confusion.h. COC_LENS or COC_PLANES is
// defined.

// w: finite; negative counts as sky.
float radius_px(float w) {
    w = max(w, 0.0);
#if defined(COC_LENS)
    precise float radius = uniforms.gain_px * (uniforms.focus_inverse - w);
#elif defined(COC_PLANES)
    float near_part = 0.0;
    float far_part = 1.0;  // of the sky
    if (w > 0.0) {
        float d = 1.0 / w;
        near_part = clamp((uniforms.near_sharp - d) * uniforms.near_inverse_span, 0.0, 1.0);
        far_part = clamp((d - uniforms.far_sharp) * uniforms.far_inverse_span, 0.0, 1.0);
    }
    precise float radius = uniforms.far_radius_px * far_part - uniforms.near_radius_px * near_part;
#endif
    return clamp(radius, -uniforms.max_radius_px, uniforms.max_radius_px);
}
