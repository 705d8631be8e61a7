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
//
// ARRAYS: which of the host's textures are arrays
// HALF: 1: of 2 x 2 pixels color is the mean, depth and motion are those of the nearest
#include "guest/depth.glsl"

#if ARRAYS & GUEST_ARRAY_COLOR
layout(binding = 0) uniform sampler2DArray host_color;
#define COLOR_TEXEL(at) texelFetch(host_color, ivec3(at, uniforms.slices.x), uniforms.levels.x)
#else
layout(binding = 0) uniform sampler2D host_color;
#define COLOR_TEXEL(at) texelFetch(host_color, at, uniforms.levels.x)
#endif
#if ARRAYS & GUEST_ARRAY_MOTION
layout(binding = 2) uniform sampler2DArray host_motion;
#define MOTION_TEXEL(at) texelFetch(host_motion, ivec3(at, uniforms.slices.z), uniforms.levels.z)
#else
layout(binding = 2) uniform sampler2D host_motion;
#define MOTION_TEXEL(at) texelFetch(host_motion, at, uniforms.levels.z)
#endif
layout(binding = 0) writeonly uniform image2D color;
layout(binding = 1) writeonly uniform image2D inverse_depth;
layout(binding = 2) writeonly uniform image2D motion;

// Inverse depths below this are infinitely far (chain/frame/frame.h).
const float kFar = 1e-9;

float inverse_depth_at(ivec2 p) {
    const float stored = stored_depth(p);
    return is_finite(stored) ? inverse_depth_of(stored) : 0.0;
}

bool makes(int what) {
    return (uniforms.makes & what) != 0;
}

// The frame's pixel that a pixel of the planes has depth and motion from.
ivec2 source_of(ivec2 p) {
#if HALF
    const ivec2 last = uniforms.full_size - 1;
    ivec2 nearest = min(2 * p, last);
    if (!makes(GUEST_READS_DEPTH)) return nearest;
    float most = inverse_depth_at(nearest);
    for (int i = 1; i < 4; ++i) {
        const ivec2 q = min(2 * p + ivec2(i & 1, i >> 1), last);
        const float w = inverse_depth_at(q);
        if (w > most) {
            most = w;
            nearest = q;
        }
    }
    return nearest;
#else
    return p;
#endif
}

// Camera motion of an infinitely far pixel, in pixels, y down.
vec2 sky_motion(ivec2 p) {
    const vec2 here = vec2(p) + 0.5;
    const vec2 size = vec2(uniforms.size);
    precise const vec3 at = vec3(2.0 * here.x / size.x - 1.0, 1.0 - 2.0 * here.y / size.y, 1.0);
    const float w = precise_dot(uniforms.sky_w.xyz, at);
    if (!(w > 0.0)) return vec2(0.0);
    const vec2 there =
        vec2(precise_dot(uniforms.sky_x.xyz, at), -precise_dot(uniforms.sky_y.xyz, at)) / w;
    precise const vec2 motion_px = uniforms.sky_sign * (0.5 * size * (there + 1.0) - here);
    return motion_px;
}

// Largest difference of inverse depth between a pixel and 2 x 2 places of a texel of motion.
float difference_of(ivec2 texel, float inverse_depth) {
    float most = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 place = 4 * texel + ivec2(2 * (i & 1) + 1, 2 * (i >> 1) + 1);
        const ivec2 q = place * uniforms.full_size / (4 * uniforms.motion_size);
        precise const float difference = inverse_depth_at(q) - inverse_depth;
        most = max(most, abs(difference));
    }
    return most;
}

// The texel of motion for a pixel of the frame. A texel at an edge has the vector of either surface.
// So of the four texels around the pixel's center it is the one that is nowhere far from the pixel's
// depth, which is one beside the edge.
ivec2 motion_texel(ivec2 p) {
    const ivec2 size = uniforms.motion_size;
    const ivec2 own = texel_of(p, size);
    if (!makes(GUEST_FINDS_MOTION)) return own;
    const float inverse_depth = inverse_depth_at(p);
    const ivec2 center = (2 * own + 1) * uniforms.full_size, here = (2 * p + 1) * size;
    const ivec2 side = ivec2(here.x < center.x ? -1 : 1, here.y < center.y ? -1 : 1);
    ivec2 best = own;
    float least = difference_of(own, inverse_depth);
    for (int i = 1; i < 4; ++i) {
        const ivec2 texel = clamp(own + side * ivec2(i & 1, i >> 1), ivec2(0), size - 1);
        const float difference = difference_of(texel, inverse_depth);
        if (difference < least) {
            least = difference;
            best = texel;
        }
    }
    return best;
}

vec2 motion_of(ivec2 p, ivec2 source) {
    const ivec2 size = uniforms.motion_size;
    const vec2 stored = MOTION_TEXEL(stored_at(motion_texel(source), uniforms.motion_at, size)).xy;
    precise vec2 v = uniforms.motion_scale * (stored - uniforms.motion_bias);
    if (makes(GUEST_MAKES_SKY) && v == vec2(0.0) && inverse_depth_at(source) <= kFar) {
        v = sky_motion(p);
    } else {
        v -= uniforms.motion_jitter;
        if (uniforms.bottom_up != 0) v.y = -v.y;
    }
    return is_finite(v.x) && is_finite(v.y) ? v : vec2(0.0);
}

vec4 color_at(ivec2 p) {
    return finite_color(COLOR_TEXEL(stored_at(p, uniforms.color_at)));
}

vec4 color_of(ivec2 p) {
#if HALF
    const ivec2 last = uniforms.full_size - 1;
    precise vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) sum += 0.25 * color_at(min(2 * p + ivec2(i & 1, i >> 1), last));
    return sum;
#else
    return color_at(p);
#endif
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    if (makes(GUEST_MAKES_COLOR)) {
        vec4 c = color_of(p);
        c.rgb *= gain();
        imageStore(color, p, finite_color(c));
    }
    const ivec2 source = source_of(p);
    if (makes(GUEST_MAKES_DEPTH))
        imageStore(inverse_depth, p, vec4(inverse_depth_at(source), 0.0, 0.0, 0.0));
    if (makes(GUEST_MAKES_MOTION)) imageStore(motion, p, vec4(motion_of(p, source), 0.0, 0.0));
}
