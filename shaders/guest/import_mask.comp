#version 450 core
// Makes the frame's matte of the host's mask; what is not a number covers nothing.
//
// ARRAYS: which of the host's textures are arrays
#include "guest/place.glsl"

#if ARRAYS & GUEST_ARRAY_MASK
layout(binding = 0) uniform sampler2DArray host_mask;
#define MASK_TEXEL(at) texelFetch(host_mask, ivec3(at, uniforms.layers.w), uniforms.levels.w)
#else
layout(binding = 0) uniform sampler2D host_mask;
#define MASK_TEXEL(at) texelFetch(host_mask, at, uniforms.levels.w)
#endif
layout(binding = 0) writeonly uniform image2DArray mattes;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const float m = MASK_TEXEL(stored_at(p, uniforms.mask_at)).x;
    imageStore(mattes, ivec3(p, 0), vec4(m > 0.0 ? min(m, 1.0) : 0.0, 0.0, 0.0, 0.0));
}
