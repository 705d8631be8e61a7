#version 450 core
// The second half of TileMax: of a tile's rows the one of largest length. Ties: the first row, so
// that over the whole tile the first pixel in row order wins.
//
//   row_max -> tile_max   x y: v, z: its squared length before the clamp, w: smallest |v|
layout(local_size_x = 16, local_size_y = 16) in;

#include "shared/motion_blur_block.h"

layout(binding = 0) uniform sampler2D row_max;
layout(binding = 0) writeonly uniform image2D tile_max;

void main() {
    const ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, block.tiles))) return;
    const int first = tile.y * block.tile_px;
    const int last = min(first + block.tile_px, block.size.y) - 1;
    vec4 result = texelFetch(row_max, ivec2(tile.x, first), 0);
    for (int y = first + 1; y <= last; ++y) {
        const vec4 row = texelFetch(row_max, ivec2(tile.x, y), 0);
        if (row.z > result.z) result.xyz = row.xyz;
        result.w = min(result.w, row.w);
    }
    imageStore(tile_max, tile, result);
}
