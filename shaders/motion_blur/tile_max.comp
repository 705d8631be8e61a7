#version 450 core
// The second half of TileMax: of a tile's rows the one of largest length. Ties: the first row, so
// that over the whole tile the first pixel in row order wins.
//
//   row_max   -> tile_max     x y: v, z: its squared length before the clamp, w: smallest |v|
//   row_range -> tile_range   RANGE: x y: smallest components of v, z w: largest
//   row_depth -> tile_depth   DEPTH: x: smallest inverse depth, y: largest
#include "common/work_group.glsl"
#include "shared/motion_blur_block.h"

layout(binding = 0) uniform sampler2D row_max;
layout(binding = 0) writeonly uniform image2D tile_max;
#if RANGE
layout(binding = 1) uniform sampler2D row_range;
layout(binding = 1) writeonly uniform image2D tile_range;
#endif
#if DEPTH
layout(binding = 2) uniform sampler2D row_depth;
layout(binding = 2) writeonly uniform image2D tile_depth;
#endif

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
#if RANGE
    vec4 range = texelFetch(row_range, ivec2(tile.x, first), 0);
    for (int y = first + 1; y <= last; ++y) {
        const vec4 row = texelFetch(row_range, ivec2(tile.x, y), 0);
        range = vec4(min(range.xy, row.xy), max(range.zw, row.zw));
    }
    imageStore(tile_range, tile, range);
#endif
#if DEPTH
    vec2 depths = texelFetch(row_depth, ivec2(tile.x, first), 0).xy;
    for (int y = first + 1; y <= last; ++y) {
        const vec2 row = texelFetch(row_depth, ivec2(tile.x, y), 0).xy;
        depths = vec2(min(depths.x, row.x), max(depths.y, row.y));
    }
    imageStore(tile_depth, tile, vec4(depths, 0.0, 0.0));
#endif
}
