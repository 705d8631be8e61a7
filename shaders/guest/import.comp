#version 450 core
// Converts a host's textures to the canonical planes of docs/frame.md. Textures that already are
// canonical are read in place instead.
//
//   host color [, exposure]   -> color, times the gain; finite
//   host depth                -> inverse depth
//   host motion [, depth]     -> motion, pixels to the next frame, y down; infinitely far pixels
//                                without a vector may get the camera's motion
//
// uniforms.makes says which of them. One program for all sets of planes: frames of a host may need
// any of them, and none is compiled between two frames. Units that a set does not use are unbound.
#include "guest/place.glsl"

layout(binding = 0) uniform sampler2D host_color;
layout(binding = 1) uniform sampler2D host_depth;
layout(binding = 2) uniform sampler2D host_motion;
layout(binding = 0) writeonly uniform image2D color;
layout(binding = 1) writeonly uniform image2D inverse_depth;
layout(binding = 2) writeonly uniform image2D motion;

// Inverse depths below this are infinitely far (chain/frame.h).
const float kFar = 1e-9;
const float kMax = 3.402823466e+38;

float inverse_depth_at(ivec2 p) {
    const float stored = texelFetch(host_depth, stored_at(p, uniforms.depth_at), 0).x;
    if (!is_finite(stored)) return 0.0;
    if (uniforms.distance != 0) return stored > 0.0 ? min(1.0 / stored, kMax) : 0.0;
    precise const float w = uniforms.depth_offset + uniforms.depth_slope * stored;
    return max(w, 0.0);
}

// Camera motion of an infinitely far pixel, in pixels, y down.
vec2 sky_motion(ivec2 p) {
    const vec2 here = vec2(p) + 0.5;
    const vec2 size = vec2(uniforms.size);
    const vec3 at = vec3(2.0 * here.x / size.x - 1.0, 1.0 - 2.0 * here.y / size.y, 1.0);
    const float w = dot(uniforms.sky_w.xyz, at);
    if (!(w > 0.0)) return vec2(0.0);
    const vec2 there = vec2(dot(uniforms.sky_x.xyz, at), -dot(uniforms.sky_y.xyz, at)) / w;
    return uniforms.sky_sign * (0.5 * size * (there + 1.0) - here);
}

bool makes(int what) {
    return (uniforms.makes & what) != 0;
}

vec2 motion_of(ivec2 p) {
    const vec2 stored = texelFetch(host_motion, stored_at(p, uniforms.motion_at), 0).xy;
    vec2 v = uniforms.motion_scale * (stored - uniforms.motion_bias);
    if (makes(GUEST_MAKES_SKY) && v == vec2(0.0) && inverse_depth_at(p) <= kFar) {
        v = sky_motion(p);
    } else {
        v -= uniforms.motion_jitter;
        if (uniforms.bottom_up != 0) v.y = -v.y;
    }
    return is_finite(v.x) && is_finite(v.y) ? v : vec2(0.0);
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    if (makes(GUEST_MAKES_COLOR)) {
        vec4 c = finite_color(texelFetch(host_color, stored_at(p, uniforms.color_at), 0));
        c.rgb *= gain();
        imageStore(color, p, finite_color(c));
    }
    if (makes(GUEST_MAKES_DEPTH))
        imageStore(inverse_depth, p, vec4(inverse_depth_at(p), 0.0, 0.0, 0.0));
    if (makes(GUEST_MAKES_MOTION)) imageStore(motion, p, vec4(motion_of(p), 0.0, 0.0));
}
