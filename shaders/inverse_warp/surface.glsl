// A surface of the inverse warp: how what is seen in one pixel is displaced, and how far away it is.
//
// Displacement in pixels at time u in [-1, 1] over the open shutter, h = half the open time, as seen
// from the point l of the lens, in the unit disc:
//
//   D(u, l) = a u + b (w |u| + (1 - w) min(h, 1) u^2) + R l
//
// a = h (motion + motion_back)/2, b = h (motion - motion_back)/2. w = 0: the parabola through the
// positions before, now and after. w = 1: a straight line to each, where the parabola would turn
// back within the frame, |b| > |a|. Between them w fades. R is the signed radius of the circle of
// confusion.
//
// SHUTTER, LENS: which of the two are open
// MOTION: surfaces hold motion: with the shutter, and where neighboring frames are searched
#include "shared/inverse_warp_uniforms.h"

#if LENS
#include "common/circle_of_confusion.glsl"
#endif

struct Surface {
    float inverse_depth;
    bool edge;       // depth jumps to a pixel next to it
#if MOTION
    vec2 a;          // px
    vec2 b;          // px
    float straight;  // w
#endif
#if LENS
    float radius;    // R, px
#endif
};

const float kStepB = 1.0 / 64.0;  // px: what b is rounded to
// Displacements squared within this ratio are alike, so that rounding does not choose: of paths cut
// off at max_path_px all are.
const float kAlike = 1.001;
const float kNotThere = -2.0;     // inverse depth of a neighbor's pixel that no search may find
const float kOneDepth = 1.05;     // inverse depths up to this ratio are one surface

// The last 8 bits of an inverse depth are replaced: 7 bits of `straight`, and `edge`.
float inverse_depth_of(uint bits) {
    return uintBitsToFloat(bits & 0xffffff00u);
}

// MOTION: x, y: a; z: b, two signed 16-bit counts of kStepB; w: inverse depth. Else x: inverse depth.
#if MOTION
#define DEPTH_BITS w
#else
#define DEPTH_BITS x
#endif

Surface unpack_surface(uvec4 bits) {
    Surface s;
    s.inverse_depth = inverse_depth_of(bits.DEPTH_BITS);
    s.edge = (bits.DEPTH_BITS & 1u) != 0u;
#if MOTION
    s.a = uintBitsToFloat(bits.xy);
    const int pair = int(bits.z);
    s.b = kStepB * vec2(float((pair << 16) >> 16), float(pair >> 16));
    s.straight = float((bits.w >> 1) & 127u) * (1.0 / 127.0);
#endif
#if LENS
    s.radius = radius_px(s.inverse_depth);
#endif
    return s;
}

uvec4 pack_surface(Surface s) {
    const uint depth = floatBitsToUint(s.inverse_depth) & 0xffffff00u;
#if MOTION
    const ivec2 b = ivec2(clamp(floor(s.b / kStepB + 0.5), -32767.0, 32767.0));
    const uint last = (uint(s.straight * 127.0 + 0.5) << 1) | (s.edge ? 1u : 0u);
    return uvec4(floatBitsToUint(s.a), uint((b.x & 0xffff) | (b.y << 16)), depth | last);
#else
    return uvec4(depth | (s.edge ? 1u : 0u), 0u, 0u, 0u);
#endif
}

// One instant and one point of the lens. `bend`: min(h, 1) u^2. `weight`: part of a sample.
struct Sample {
    float u, bend;
    vec2 lens;
    float weight;
};

float bend_at(float u) {
    return min(uniforms.half_shutter, 1.0) * u * u;
}

#if MOTION
vec2 moved(Surface s, Sample at) {
    return s.a * at.u + s.b * mix(at.bend, abs(at.u), s.straight);
}
#endif

vec2 displacement(Surface s, Sample at) {
#if SHUTTER && LENS
    return moved(s, at) + s.radius * at.lens;
#elif SHUTTER
    return moved(s, at);
#else
    return s.radius * at.lens;
#endif
}

#if MOTION
// Longest path on either side of the frame, px.
float path_of(Surface s) {
    return sqrt(max(dot(s.a + s.b, s.a + s.b), dot(s.a - s.b, s.a - s.b)));
}
#endif

// Longest displacement, px.
float longest_of(Surface s) {
    float px = 0.0;
#if SHUTTER
    px += path_of(s);
#endif
#if LENS
    px += abs(s.radius);
#endif
    return px;
}

// How much a surface is displaced, px^2.
float displaced(Surface s) {
    float squared = 0.0;
#if SHUTTER
    squared += dot(s.a, s.a) + dot(s.b, s.b);
#endif
#if LENS
    squared += s.radius * s.radius;
#endif
    return squared;
}

// How differently two surfaces are displaced, px^2.
float apart(Surface s, Surface t) {
    float squared = 0.0;
#if SHUTTER
    const vec2 da = s.a - t.a, db = s.b - t.b;
    squared += dot(da, da) + dot(db, db);
#endif
#if LENS
    squared += (s.radius - t.radius) * (s.radius - t.radius);
#endif
    return squared;
}

bool one_depth(float q, float r) {
    return q <= kOneDepth * r && r <= kOneDepth * q;
}
