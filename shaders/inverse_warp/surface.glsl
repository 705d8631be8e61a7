// A surface of the inverse warp: how the surface seen in one pixel is displaced, and how far away
// it is.
//
// Displacement in pixels at time u in [-1, 1] over the open shutter, h = half the open time, as
// seen through the lens sample l in the unit disc:
//
//   D(u, l) = a u + b (w |u| + (1 - w) min(h, 1) u^2) + R l
//
// a = h (motion + motion_back)/2, b = h (motion - motion_back)/2. w = 0: the parabola through the
// positions before, now and after. w = 1: a straight line to each, used if the path bends
// much and the neighbors' vectors show a bounce (planes.glsl). Between the two w fades. R is the signed radius of the circle of confusion.
//
// SHUTTER, LENS: which of the two are open
// MOTION: surfaces hold motion: with the shutter, and if neighboring frames are searched
// STRAIGHT: no frame has a motion_back plane: b and w are 0
#include "common/precise.glsl"
#include "shared/inverse_warp_constants.h"
#include "shared/inverse_warp_uniforms.h"

const bool kShutter = SHUTTER == 1, kLens = LENS == 1;

#if LENS
#include "common/circle_of_confusion.glsl"
#else
float radius_px(float inverse_depth) {
    return 0.0;
}
#endif

// From the first half of a texture of two frames' surfaces to the second: Area::two().
ivec2 second_half() {
    const ivec2 size = uniforms.size;
    return size.x >= size.y ? ivec2(0, size.y) : ivec2(size.x, 0);
}

// Without MOTION a, b and w are 0; without LENS R is 0.
struct Surface {
    float inverse_depth;
    bool edge;       // depth jumps to a pixel next to it
    bool refuted;    // of a neighbor: this frame shows a farther surface at its place
    vec2 a;          // px
    vec2 b;          // px
    float straight;  // w
    float radius;    // R, px
};

const float kStepB = 1.0 / 64.0;  // px: b is rounded to multiples of it
const float kNotThere = -2.0;  // inverse depth of a neighbor's pixel that no search may find

bool one_depth(float q, float r) {
    return q <= kOneDepth * r && r <= kOneDepth * q;
}

// The last 2 bits of an inverse depth are replaced: `refuted` and `edge`. A steep lens turns 1e-5 of
// depth into a pixel of radius.
float inverse_depth_of(uint bits) {
    return uintBitsToFloat(bits & ~3u);
}

const uint kEdge = 1u, kRefuted = 2u;  // the last bits of a surface

#if MOTION
// x, y: a, in the last 3 bits of both the 6 bits of `straight`; z: b, two signed 16-bit counts of
// kStepB; w: inverse depth
Surface unpack_surface(uvec4 bits) {
    const float q = inverse_depth_of(bits.w);
    Surface s = Surface(q, (bits.w & kEdge) != 0u, (bits.w & kRefuted) != 0u,
                        uintBitsToFloat(bits.xy & ~7u), vec2(0.0), 0.0, radius_px(q));
#if !STRAIGHT
    const int pair = int(bits.z);
    s.b = kStepB * vec2(float((pair << 16) >> 16), float(pair >> 16));
    s.straight = float((bits.x & 7u) << 3 | (bits.y & 7u)) * (1.0 / 63.0);
#endif
    return s;
}

uvec4 pack_surface(Surface s) {
    const uint depth = floatBitsToUint(s.inverse_depth) & ~3u;
    precise const vec2 steps = floor(s.b / kStepB + 0.5);
    precise const float straight = s.straight * 63.0 + 0.5;
    const ivec2 b = ivec2(clamp(steps, -32767.0, 32767.0));
    const uvec2 a = floatBitsToUint(s.a) & ~7u | (uvec2(uint(straight)) >> uvec2(3u, 0u) & 7u);
    return uvec4(a, uint((b.x & 0xffff) | (b.y << 16)),
                 depth | (s.refuted ? kRefuted : 0u) | (s.edge ? kEdge : 0u));
}
#else
// x: inverse depth
Surface unpack_surface(uvec4 bits) {
    const float q = inverse_depth_of(bits.x);
    return Surface(q, (bits.x & kEdge) != 0u, false, vec2(0.0), vec2(0.0), 0.0, radius_px(q));
}

uvec4 pack_surface(Surface s) {
    const uint depth = floatBitsToUint(s.inverse_depth) & ~3u;
    return uvec4(depth | (s.edge ? kEdge : 0u), 0u, 0u, 0u);
}
#endif

// Without `edge` and `refuted`.
uvec4 without_flags(uvec4 bits) {
#if MOTION
    return uvec4(bits.xyz, bits.w & ~3u);
#else
    return uvec4(bits.x & ~3u, bits.yzw);
#endif
}

// A neighbor's surface that this frame hides, and around which the light has changed between the frames. It
// has no w, whose last bit says so.
uvec4 in_other_light(uvec4 bits) {
    return bits | uvec4(1u, 0u, 0u, 0u);
}

bool is_in_other_light(uvec4 bits) {
    return (bits.x & 1u) != 0u;
}

Surface unpack_neighbor(uvec4 bits) {
    return unpack_surface(bits & uvec4(~1u, uvec3(~0u)));
}

Surface not_there() {
    return Surface(kNotThere, false, false, vec2(0.0), vec2(0.0), 0.0, 0.0);
}

// One time sample and one lens sample.
struct Sample {
    float u, bend;      // bend: min(h, 1) u^2
    vec2 lens;
    float weight;       // less than 1: part of a sample
    float depth_ratio;  // inverse depths within this ratio count as one depth
};

float bend_at(float u) {
    return min(uniforms.half_shutter, 1.0) * u * u;
}

vec2 moved(Surface s, Sample at) {
    precise vec2 d = s.a * at.u;
#if !STRAIGHT
    d += s.b * precise_mix(at.bend, abs(at.u), s.straight);
#endif
    return d;
}

vec2 displacement(Surface s, Sample at) {
    if (!kLens) return moved(s, at);
    precise vec2 d = s.radius * at.lens;
    if (kShutter) d = moved(s, at) + d;
    return d;
}

// Longest path on either side of the frame, px.
float path_of(Surface s) {
    precise const float px2 = max(precise_dot(s.a + s.b, s.a + s.b), precise_dot(s.a - s.b, s.a - s.b));
    return sqrt(px2);
}

// Longest displacement, px.
float longest_of(Surface s) {
    precise float px = 0.0;
    if (kShutter) px += path_of(s);
    if (kLens) px += abs(s.radius);
    return px;
}

// Size of a surface's displacements, px^2.
float displaced(Surface s) {
    precise float squared = 0.0;
    if (kShutter) squared += precise_dot(s.a, s.a) + precise_dot(s.b, s.b);
    if (kLens) squared += s.radius * s.radius;
    return squared;
}

// The order in which squared displacements, px^2, are chosen: the largest key, then the lowest index, in
// whatever order they are compared. Those with one key, 0.1 %, are equal, so that rounding does not
// choose: all paths cut off at max_path_px are equal. 0x1555 keeps the bounds between keys away from
// numbers of few digits, which are common.
const int kKeyBits = 18;
int key_of(float px2) {
    return int(floatBitsToUint(px2) + 0x1555u >> 13);
}

// Difference between the displacements of two surfaces, px^2.
float apart(Surface s, Surface t) {
    precise float squared = 0.0;
    const vec2 da = s.a - t.a, db = s.b - t.b;
    if (kShutter) squared += precise_dot(da, da) + precise_dot(db, db);
    if (kLens) squared += (s.radius - t.radius) * (s.radius - t.radius);
    return squared;
}
