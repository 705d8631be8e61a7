#version 450 core
// How bright each tile of kBlockPx x kBlockPx pixels is: the mean of its pixels' largest components.
// One thread for a tile.
//
//   color -> tile_light   tiles.x by tiles.y
#include "common/finite.glsl"
#include "common/work_group.glsl"
#include "shared/inverse_warp_block.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D tile_light;

void main() {
    const ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, block.tiles))) return;
    const ivec2 first = kBlockPx * tile;
    const ivec2 end = min(first + kBlockPx, block.size);
    float light = 0.0;
    for (int y = first.y; y < end.y; ++y) {
        for (int x = first.x; x < end.x; ++x) {
            const vec4 c = texelFetch(color, ivec2(x, y), 0);
            const float largest = max(c.r, max(c.g, c.b));
            if (is_finite(largest)) light += clamp(largest, 0.0, 1e30);
        }
    }
    const ivec2 extent = end - first;
    imageStore(tile_light, tile, vec4(light / float(extent.x * extent.y)));
}
