#version 450 core
// Motion vectors without the motion of an object that counts as standing still (docs/layers.md).
//
//   motion [, motion_back] [, inverse_depth], mattes -> still_motion [, still_motion_back]
//
// MATTE: index of the pass's matte    BACK: has motion_back    DEPTH: has inverse_depth
#include "common/matte.glsl"
#include "common/work_group.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2D motion;
layout(binding = 1) uniform sampler2DArray mattes;
#if DEPTH
layout(binding = 2) uniform sampler2D inverse_depth;
#endif
#if BACK
layout(binding = 3) uniform sampler2D motion_back;
#endif
layout(binding = 0) writeonly uniform image2D still_motion;
#if BACK
layout(binding = 1) writeonly uniform image2D still_motion_back;
#endif

#if DEPTH
// A soft pixel shows object and ground, and has the depth of one of them. If both are this near
// without the other, at two depths, the pixel has the motion of the one whose depth it has: the
// object's is 0, the ground's is found at the nearest pixel of it.
const int kAround = 2;
const float kOneDepth = 1.05;

float depth_at(ivec2 p) {
    return max(texelFetch(inverse_depth, p, 0).x, 0.0);
}

void divide(ivec2 p, inout ivec2 from, inout float kept) {
    bool object = false, object_here = false, ground = false, ground_here = false;
    const float q = depth_at(p);
    ivec2 nearest = p;
    int nearest_square = 2 * kAround * kAround + 1;
    for (int j = -kAround; j <= kAround; ++j)
        for (int i = -kAround; i <= kAround; ++i) {
            const ivec2 at = p + ivec2(i, j);
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, uniforms.size))) continue;
            const float m = matte_at(at);
            if (m > 0.0 && m < 1.0) continue;
            const float r = depth_at(at);
            const bool here = q <= kOneDepth * r && r <= kOneDepth * q;
            if (m >= 1.0) {
                object = true;
                object_here = object_here || here;
                continue;
            }
            ground = true;
            ground_here = ground_here || here;
            const int square = i * i + j * j;
            if (here && square < nearest_square) {
                nearest = at;
                nearest_square = square;
            }
        }
    if (!object || !ground || object_here == ground_here) return;
    kept = object_here ? 0.0 : 1.0;
    from = object_here ? p : nearest;
}
#endif

// The whole vector comes back bit for bit, none of it is 0 and not minus 0.
vec4 part_of(sampler2D vectors, ivec2 from, float kept) {
    if (kept <= 0.0) return vec4(0.0);
    const vec4 v = texelFetch(vectors, from, 0);
    return kept >= 1.0 ? v : without(v, kept);
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const float m = matte_at(p);
    float kept = 1.0 - m;
    ivec2 from = p;
#if DEPTH
    if (m > 0.0 && m < 1.0) divide(p, from, kept);
#endif
    imageStore(still_motion, p, part_of(motion, from, kept));
#if BACK
    imageStore(still_motion_back, p, part_of(motion_back, from, kept));
#endif
}
