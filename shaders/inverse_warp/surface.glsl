// A surface of the inverse warp: how what is seen in one pixel moves, and how far away it is.
//
// Displacement in pixels at time u in [-1, 1] over the open shutter, h = half the open time:
//
//   D(u) = a u + b (w |u| + (1 - w) min(h, 1) u^2)
//
// a = h (motion + motion_back)/2, b = h (motion - motion_back)/2. w = 0: the parabola through the
// positions before, now and after. w = 1: a straight line to each, where the parabola would turn
// back within the frame, |b| > |a|. Between them w fades.
#include "shared/inverse_warp_block.h"

struct Surface {
    vec2 a;              // px
    vec2 b;              // px
    float straight;      // w
    float inverse_depth;
    bool edge;           // depth jumps to a pixel next to it
};

const float kStepB = 1.0 / 64.0;  // px: what b is rounded to
const float kOneDepth = 1.05;     // inverse depths up to this ratio are one surface

// x, y: a. z: b, two signed 16-bit counts of kStepB. w: inverse depth with its last 8 bits
// replaced, 7 bits of `straight` and `edge`.
float inverse_depth_of(uvec4 bits) {
    return uintBitsToFloat(bits.w & 0xffffff00u);
}

Surface unpack_surface(uvec4 bits) {
    Surface s;
    s.a = uintBitsToFloat(bits.xy);
    const int pair = int(bits.z);
    s.b = kStepB * vec2(float((pair << 16) >> 16), float(pair >> 16));
    s.straight = float((bits.w >> 1) & 127u) * (1.0 / 127.0);
    s.inverse_depth = inverse_depth_of(bits);
    s.edge = (bits.w & 1u) != 0u;
    return s;
}

uvec4 pack_surface(Surface s) {
    const ivec2 b = ivec2(clamp(floor(s.b / kStepB + 0.5), -32767.0, 32767.0));
    const uint last = (uint(s.straight * 127.0 + 0.5) << 1) | (s.edge ? 1u : 0u);
    return uvec4(floatBitsToUint(s.a), uint((b.x & 0xffff) | (b.y << 16)),
                 (floatBitsToUint(s.inverse_depth) & 0xffffff00u) | last);
}

// `bend`: min(h, 1) u^2.
vec2 displacement(vec2 a, vec2 b, float straight, float u, float bend) {
    return a * u + b * mix(bend, abs(u), straight);
}

// Longest displacement on either side of the frame, px.
float path_of(Surface s) {
    return sqrt(max(dot(s.a + s.b, s.a + s.b), dot(s.a - s.b, s.a - s.b)));
}

// How differently two surfaces move, px^2.
float apart(Surface s, Surface t) {
    const vec2 da = s.a - t.a, db = s.b - t.b;
    return dot(da, da) + dot(db, db);
}

bool one_depth(float q, float r) {
    return q <= kOneDepth * r && r <= kOneDepth * q;
}
