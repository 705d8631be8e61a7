// The surface of a pixel, from the planes of its frame.
//
// MOTION: a motion plane is available
// NEIGHBOR: of the frame before or after; pixels whose inverse depth is below 0 are never found
// BACK: a motion_back plane too; otherwise it is taken to equal motion: straight paths at one speed
// TURNS_BEFORE, TURNS_AFTER: defined if both motion planes of that neighbor are available, to tell what
// turns from what bounces
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
#ifdef TURNS_BEFORE
layout(binding = 7) uniform sampler2D motion_before;
layout(binding = 8) uniform sampler2D motion_back_before;
#endif
#ifdef TURNS_AFTER
layout(binding = 9) uniform sampler2D motion_after;
layout(binding = 10) uniform sampler2D motion_back_after;
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

// x: along, y: across the acceleration in this frame, as parts of it; below 0: unknown.
const vec2 kUnknownTurn = vec2(-1.0);

#if defined(TURNS_BEFORE) || defined(TURNS_AFTER)
// The acceleration of this frame's surface in a neighbor. One against that in this frame counts as none:
// what bounces to and fro has it, what turns does not. `at`: where the neighbor shows the surface, there
// or at the adjacent pixel that fits best; `between`: its motion between the two frames.
vec2 turn_in(sampler2D forward, sampler2D back, bool after, vec2 at, vec2 between,
             vec2 acceleration) {
    const vec2 x = floor(at + 0.5);
    if (!all(greaterThanEqual(x, vec2(0.0))) || !all(lessThan(x, vec2(uniforms.size))))
        return kUnknownTurn;
    // Another surface has another motion between the frames.
    precise float least = kOtherMotionPx * kOtherMotionPx +
                          kOtherMotion * kOtherMotion * precise_dot(between, between);
    vec2 there = vec2(0.0);
    bool found = false;
    for (int i = -1; i < 4; ++i) {
        const ivec2 beside = i < 0 ? ivec2(x) : nearest_inside(ivec2(x) + kAround[i]);
        const vec2 m = texelFetch(forward, beside, 0).xy, k = texelFetch(back, beside, 0).xy;
        precise const vec2 other = (after ? k : m) - between;
        precise const float apart_px = precise_dot(other, other);
        if (!is_finite(vec4(m, k)) || apart_px > least) continue;
        least = apart_px;
        there = m - k;
        found = true;
        if (i < 0) break;
    }
    if (!found) return kUnknownTurn;
    const float squared = max(precise_dot(acceleration, acceleration), 1e-6);
    precise const float along = precise_dot(there, acceleration) / squared;
    precise const float across =
        abs(there.x * acceleration.y - there.y * acceleration.x) / squared;
    return vec2(max(along, 0.0), across);
}
#endif

float smoothstep_of(float from, float to, float x) {
    precise const float t = clamp((x - from) / (to - from), 0.0, 1.0), s = t * t * (3.0 - 2.0 * t);
    return s;
}

// 1: a surface with this turn_in() in a neighbor bounces, 0: it turns, and accelerates there too. One that the
// neighbor does not show bounces if it stops or turns back. ratio: (|b|/|a|)^2
float bounce_by(vec2 turn, float ratio) {
    if (turn.x < 0.0) return smoothstep_of(kBentUnseen, kTurnedUnseen, ratio);
    precise const float bounce = 1.0 - max(smoothstep_of(kBounce, kTurn, turn.x),
                                           smoothstep_of(kBounceAcross, kTurnAcross, turn.y));
    return bounce;
}

// By both neighbors. A frame without them takes everything for a turn.
float bounce_of(ivec2 p, vec4 motion, float ratio) {
#if defined(TURNS_BEFORE) || defined(TURNS_AFTER)
    float bounce = 1.0;
#else
    float bounce = 0.0;
#endif
#ifdef TURNS_BEFORE
    const vec2 before = turn_in(motion_before, motion_back_before, false, vec2(p) - motion.zw, motion.zw,
                                motion.xy - motion.zw);
    bounce = min(bounce, bounce_by(before, ratio));
#endif
#ifdef TURNS_AFTER
    const vec2 after = turn_in(motion_after, motion_back_after, true, vec2(p) + motion.xy, motion.xy,
                               motion.xy - motion.zw);
    bounce = min(bounce, bounce_by(after, ratio));
#endif
    return bounce;
}

// The surface of pixel p. q: its inverse depth; `motion`: xy: motion, zw: motion_back
Surface surface_of(ivec2 p, float q, bool edge, vec4 motion) {
    precise Surface s = Surface(q, edge, false, vec2(0.0), vec2(0.0), 0.0, 0.0);
#if MOTION
    const vec4 v = uniforms.half_shutter * motion;
    s.a = 0.5 * (v.xy + v.zw);
    s.b = 0.5 * (v.xy - v.zw);
    precise const float ratio = precise_dot(s.b, s.b) / max(precise_dot(s.a, s.a), 1e-6);
    s.straight = smoothstep_of(kBent, kTurned, ratio);
    if (s.straight > 0.0) s.straight *= bounce_of(p, motion, ratio);
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
    return surface_of(p, q, edge, motion);
}
