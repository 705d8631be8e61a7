#version 450 core
// NeighborMax: the longest vector of the 3 x 3 tiles around a tile whose blur can reach it. The
// tile itself and its on-axis neighbors always count. A diagonal neighbor at offset (ox, oy) counts
// only if its vector lies along that diagonal, sign(ox vx) = sign(oy vy), not zero: blur reaches
// along +v and -v, so the test is two-sided. With SINGLE all eight count.
//
//   tile_max -> neighbor_max   x y: v, z: its squared length before the clamp, w: smallest |v| of
//                              all tiles around
#include "common/work_group.glsl"
#include "shared/motion_blur_uniforms.h"

layout(binding = 0) uniform sampler2D tile_max;
layout(binding = 0) writeonly uniform image2D neighbor_max;

bool reaches(ivec2 offset, vec2 v) {
#if SINGLE
    return true;
#else
    if (offset.x == 0 || offset.y == 0) return true;
    const vec2 side = sign(vec2(offset) * v);
    return side.x == side.y && side.x != 0.0;
#endif
}

void main() {
    const ivec2 tile = invocation_at();
    if (any(greaterThanEqual(tile, uniforms.tiles))) return;
    vec4 result = texelFetch(tile_max, tile, 0);
    for (int oy = -1; oy <= 1; ++oy) {
        for (int ox = -1; ox <= 1; ++ox) {
            const ivec2 at = tile + ivec2(ox, oy);
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, uniforms.tiles))) continue;
            const vec4 other = texelFetch(tile_max, at, 0);
            result.w = min(result.w, other.w);
            if (other.z > result.z && reaches(ivec2(ox, oy), other.xy)) result.xyz = other.xyz;
        }
    }
    imageStore(neighbor_max, tile, result);
}
