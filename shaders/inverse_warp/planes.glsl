// The surface of a pixel, from the planes of its frame.
//
// MOTION: a motion plane is available
// NEIGHBOR: of the frame before or after; pixels whose inverse depth is below 0 are never found
// BACK: a motion_back plane too; otherwise it is taken to equal motion: straight paths at one speed
// SECOND_LAYER: defined if the planes are those of the layer behind (chain/frame/behind.h)
#include "common/finite.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/surface.glsl"

#ifdef SECOND_LAYER
layout(binding = 0) uniform sampler2DArray second_layer;
#else
layout(binding = 0) uniform sampler2D inverse_depth;
#if MOTION
layout(binding = 1) uniform sampler2D motion;
#endif
#if BACK
layout(binding = 2) uniform sampler2D motion_back;
#endif
#endif

ivec2 nearest_inside(ivec2 p) {
    return clamp(p, ivec2(0), uniforms.size - 1);
}

float depth_at(ivec2 p) {
#ifdef SECOND_LAYER
    const float q = texelFetch(second_layer, ivec3(p, 1), 0).x;
    if (q < 0.0) return kNotThere;
#else
    const float q = texelFetch(inverse_depth, p, 0).x;
#endif
#if NEIGHBOR
    if (q < 0.0) return kNotThere;
#endif
    return q > 0.0 ? min(q, 3.0e38) : 0.0;
}

// As surfaces hold it.
float stored_depth_at(ivec2 p) {
    return inverse_depth_of(floatBitsToUint(depth_at(p)));
}

#if MOTION
// xy: motion, zw: motion_back
vec4 motion_at(ivec2 p) {
#ifdef SECOND_LAYER
    const vec4 both = texelFetch(second_layer, ivec3(p, 2), 0);
#else
    const vec2 forward = texelFetch(motion, p, 0).xy;
#if BACK
    const vec4 both = vec4(forward, texelFetch(motion_back, p, 0).xy);
#else
    const vec4 both = vec4(forward, forward);
#endif
#endif
    return is_finite(both) ? clamp(both, vec4(-1e15), vec4(1e15)) : vec4(0.0);
}

// The motion of the pixel's own surface. A renderer averages motion vectors over the pixel's
// samples, but not depth: at a depth edge, the pixel takes the motion of the adjacent pixel of its
// surface that differs most from the other surface's.
vec4 own_motion(ivec2 p, float q, out bool edge) {
    const vec4 own = motion_at(p);
    vec4 around[4];
    bool same[4];
    precise vec4 other = vec4(0.0);
    precise float count = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 at = nearest_inside(p + kAround[i]);
        around[i] = motion_at(at);
        same[i] = one_depth(q, depth_at(at));
        if (!same[i]) {
            other += around[i];
            count += 1.0;
        }
    }
    edge = count > 0.0;
    if (!edge) return own;
    other /= count;
    vec4 farthest = own;
    precise float most = precise_dot(own - other, own - other);
    for (int i = 0; i < 4; ++i) {
        precise const float apart_px = precise_dot(around[i] - other, around[i] - other);
        if (same[i] && apart_px > most) {
            most = apart_px;
            farthest = around[i];
        }
    }
    return farthest;
}
#else
vec4 motion_at(ivec2 p) {
    return vec4(0.0);
}

vec4 own_motion(ivec2 p, float q, out bool edge) {
    edge = false;
    for (int i = 0; i < 4; ++i)
        edge = edge || !one_depth(q, depth_at(nearest_inside(p + kAround[i])));
    return vec4(0.0);
}
#endif

// q: inverse depth; `motion`: xy: motion, zw: motion_back
Surface surface_of(float q, bool edge, vec4 motion) {
    precise Surface s = Surface(q, edge, false, vec2(0.0), vec2(0.0), 0.0, 0.0);
#if MOTION
    const vec4 v = uniforms.half_shutter * motion;
    s.a = 0.5 * (v.xy + v.zw);
    s.b = 0.5 * (v.xy - v.zw);
    // smoothstep(0.64, 1.44, |b|^2 / |a|^2)
    precise const float ratio = precise_dot(s.b, s.b) / max(precise_dot(s.a, s.a), 1e-6);
    precise const float t = clamp((ratio - 0.64) / (1.44 - 0.64), 0.0, 1.0);
    s.straight = t * t * (3.0 - 2.0 * t);
    const float path = path_of(s);
    if (path > uniforms.max_path_px) {
        s.a *= uniforms.max_path_px / path;
        s.b *= uniforms.max_path_px / path;
    }
#endif
    return s;
}

Surface surface_at(ivec2 p) {
    const float q = depth_at(p);
    bool edge;
    const vec4 motion = own_motion(p, q, edge);
    return surface_of(q, edge, motion);
}
