#version 450 core
// Sorts the blocks of 16 x 16 pixels by the work of the gather in them. One thread per block.
//
//   neighbor_max [, tile_depth] -> work lists
//
//   still     STILL: no tile that a pixel can choose moves by more than the limit: color is copied
//   sky       SKY: one depth as far as taps reach: no depths are compared, and no bit changes
//   full      all others
#include "common/work_list.glsl"
#include "shared/motion_blur_uniforms.h"

#include "motion_blur/velocity.glsl"

layout(binding = 0) uniform sampler2D neighbor_max;
#if SKY
layout(binding = 1) uniform sampler2D tile_depth;
#endif
layout(std430, binding = 0) buffer FullBlocks { WORK_LIST } full_blocks;
#if STILL
layout(std430, binding = 1) buffer StillBlocks { WORK_LIST } still_blocks;
#endif
#if SKY
layout(std430, binding = 2) buffer SkyBlocks { WORK_LIST } sky_blocks;
#endif

ivec2 tile_of(vec2 p) {
    return clamp(ivec2(floor(p / float(uniforms.tile_px))), ivec2(0), uniforms.tiles - 1);
}

void main() {
    const ivec2 at = invocation_at();
    precise const vec2 first = vec2(kBlockPx * at) + 0.5;
    if (any(greaterThan(first, vec2(uniforms.size)))) return;
    precise const vec2 last = min(first + float(kBlockPx - 1), vec2(uniforms.size) - 0.5);

    float longest_squared = 0.0;
    {
        // Pixels choose the tile across a border up to r/(2 tau) from it; one more for rounding.
        const float edge = float(uniforms.tile_px);
#if TILE_JITTER
        precise const float across = min(edge, 0.5 * edge / max(uniforms.tile_jitter_slope, 1e-3)) + 1.0;
#else
        const float across = 1.0;
#endif
        precise const vec2 from = first - across, to = last + across;
        const ivec2 low = tile_of(from), high = tile_of(to);
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) {
                const vec2 v = texelFetch(neighbor_max, ivec2(x, y), 0).xy;
                longest_squared = max(longest_squared, precise_dot(v, v));
            }
        }
    }
#if STILL
    if (is_still(longest_squared)) {
        ADD_TO_WORK_LIST(still_blocks, at);
        return;
    }
#endif

#if SKY
    // Taps lie at most r away, and half a pixel more if they are rounded; a vector stored in 8 bits
    // may be longer by half of a step, sqrt(2)/2 r/127.
    precise const float reach = 1.006 * float(uniforms.tile_px) + 1.0;
    precise const vec2 from = first - reach, to = last + reach;
    const ivec2 low = tile_of(from), high = tile_of(to);
    vec2 depths = texelFetch(tile_depth, low, 0).xy;
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            const vec2 tile = texelFetch(tile_depth, ivec2(x, y), 0).xy;
            depths = vec2(min(depths.x, tile.x), max(depths.y, tile.y));
        }
    }
    if (depths.x == depths.y) {
        ADD_TO_WORK_LIST(sky_blocks, at);
        return;
    }
#endif
    ADD_TO_WORK_LIST(full_blocks, at);
}
