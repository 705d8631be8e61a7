// Inverse depths of the host's depth texture. ARRAYS: which of the host's textures are arrays.
#include "common/precise.glsl"
#include "guest/place.glsl"

#if ARRAYS & GUEST_ARRAY_DEPTH
layout(binding = 1) uniform sampler2DArray host_depth;
#define DEPTH_TEXEL(at) texelFetch(host_depth, ivec3(at, uniforms.slices.y), uniforms.levels.y)
#else
layout(binding = 1) uniform sampler2D host_depth;
#define DEPTH_TEXEL(at) texelFetch(host_depth, at, uniforms.levels.y)
#endif

const float kMax = 3.402823466e+38;

float stored_depth(ivec2 p) {
    const ivec2 size = uniforms.depth_size;
    return DEPTH_TEXEL(stored_at(texel_of(p, size), uniforms.depth_at, size)).x;
}

// Precondition: it is finite.
float inverse_depth_of(float stored) {
    if (uniforms.distance != 0) return stored > 0.0 ? min(1.0 / stored, kMax) : 0.0;
    float depth = stored;
    if (uniforms.clips != 0) {
        precise const float part = (stored - uniforms.depth_first) * uniforms.depth_factor;
        depth = clamp(part, 0.0, 1.0);
    }
    precise const float w = uniforms.depth_offset + uniforms.depth_slope * depth;
    return max(w, 0.0);
}
