#version 450 core
// TileVariance: the variance of directions around a tile, u = 1 - mean |n . n'| over the tile and
// its neighbors, n the direction of each tile's TileMax. Neighbors slower than 0.5 px have no
// direction and do not count; a still tile has u = 0.
//
//   tile_max -> tile_variance   x: u in [0, 1]
#include "common/precise.glsl"
#include "common/work_group.glsl"
#include "shared/motion_blur_uniforms.h"

layout(binding = 0) uniform sampler2D tile_max;
layout(binding = 0) writeonly uniform image2D tile_variance;

const float kStillPx = 0.5;

void main() {
    const ivec2 tile = invocation_at();
    if (any(greaterThanEqual(tile, uniforms.tiles))) return;
    const vec2 own = texelFetch(tile_max, tile, 0).xy;
    precise float sum = 0.0;
    precise float count = 0.0;
    if (precise_length(own) >= kStillPx) {
        const vec2 n = precise_normalize(own);
        for (int oy = -1; oy <= 1; ++oy) {
            for (int ox = -1; ox <= 1; ++ox) {
                const ivec2 at = tile + ivec2(ox, oy);
                if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, uniforms.tiles))) continue;
                const vec2 other = texelFetch(tile_max, at, 0).xy;
                if (precise_length(other) < kStillPx) continue;
                sum += abs(precise_dot(n, precise_normalize(other)));
                count += 1.0;
            }
        }
    }
    precise const float u = count > 0.0 ? clamp(1.0 - sum / count, 0.0, 1.0) : 0.0;
    imageStore(tile_variance, tile, vec4(u));
}
