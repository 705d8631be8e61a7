#version 450 core
// Makes the frame's matte of the host's mask; what is not a number covers nothing.
//
// ARRAYS: which of the host's textures are arrays    HALF: 1: the mean of 2 x 2 pixels
#include "guest/place.glsl"

#if ARRAYS & GUEST_ARRAY_MASK
layout(binding = 0) uniform sampler2DArray host_mask;
#define MASK_TEXEL(at) texelFetch(host_mask, ivec3(at, uniforms.slices.w), uniforms.levels.w)
#else
layout(binding = 0) uniform sampler2D host_mask;
#define MASK_TEXEL(at) texelFetch(host_mask, at, uniforms.levels.w)
#endif
layout(binding = 0) writeonly uniform image2DArray mattes;

float mask_at(ivec2 p) {
    const float m = MASK_TEXEL(stored_at(p, uniforms.mask_at)).x;
    return m > 0.0 ? min(m, 1.0) : 0.0;
}

float mask_of(ivec2 p) {
#if HALF
    const ivec2 last = uniforms.full_size - 1;
    precise float sum = 0.0;
    for (int i = 0; i < 4; ++i) sum += 0.25 * mask_at(min(2 * p + ivec2(i & 1, i >> 1), last));
    return sum;
#else
    return mask_at(p);
#endif
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    imageStore(mattes, ivec3(p, 0), vec4(mask_of(p), 0.0, 0.0, 0.0));
}
