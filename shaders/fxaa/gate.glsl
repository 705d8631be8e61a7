// The gate of an earlier blur's hint, 0..1. Needs uniforms.
#if HINT || BLURRED == 1
layout(binding = 2) uniform sampler2D hint_plane;

float hint_at(ivec2 p) {
    const vec2 gates = texelFetch(hint_plane, p, 0).xy;
    float hint = uniforms.hint_gate == 0 ? gates.x : gates.y;
    hint = hint > 0.0 ? min(hint, 1.0) : 0.0;  // NaN means no hint
    return hint;
}
#else
float hint_at(ivec2 p) {
    return 0.0;
}
#endif
