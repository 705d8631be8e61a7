#version 450 core
// Sorts the blocks of 16 x 16 pixels by the work of the gather in them. One thread per block.
//
//   neighbor_max [, tile_depth] [, tile_range] -> work lists
//
//   still     STILL: no tile that a pixel can choose moves by more than the limit: color is copied
//   sky       SKY: one depth as far as taps reach: no depths are compared, and no bit changes
//   uniform   UNIFORM: one motion and one depth layer as far as taps reach, and every v_max that
//             a pixel can choose that same motion, within kAlike
//   full      all others
#include "common/work_list.glsl"
#include "shared/motion_blur_uniforms.h"

#include "motion_blur/velocity.glsl"

layout(binding = 0) uniform sampler2D neighbor_max;
#if SKY || (UNIFORM && DEPTH)
layout(binding = 1) uniform sampler2D tile_depth;
#endif
#if UNIFORM
layout(binding = 2) uniform sampler2D tile_range;
#endif
layout(std430, binding = 0) buffer FullBlocks { WORK_LIST } full_blocks;
#if STILL
layout(std430, binding = 1) buffer StillBlocks { WORK_LIST } still_blocks;
#endif
#if SKY
layout(std430, binding = 2) buffer SkyBlocks { WORK_LIST } sky_blocks;
#endif
#if UNIFORM
layout(std430, binding = 3) buffer UniformBlocks { WORK_LIST } uniform_blocks;
#endif

// Motions that differ by this part of their length, and depths whose comparison changes a weight by
// this part of itself, count as one: the result changes by at most 1e-3 of the range of its colors
// nearby (docs/motion_blur.md).
const float kAlike = 2.5e-4;

ivec2 tile_of(vec2 p) {
    return clamp(ivec2(floor(p / float(uniforms.tile_px))), ivec2(0), uniforms.tiles - 1);
}

void main() {
    const ivec2 at = invocation_at();
    precise const vec2 first = vec2(kBlockPx * at) + 0.5;
    if (any(greaterThan(first, vec2(uniforms.size)))) return;
    precise const vec2 last = min(first + float(kBlockPx - 1), vec2(uniforms.size) - 0.5);

    float longest_squared = 0.0;
    vec4 chosen = vec4(1.0, 1.0, -1.0, -1.0) * float(2 * uniforms.tile_px);
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
                chosen = vec4(min(chosen.xy, v), max(chosen.zw, v));
            }
        }
    }
#if STILL
    if (is_still(longest_squared)) {
        ADD_TO_WORK_LIST(still_blocks, at);
        return;
    }
#endif

#if SKY || UNIFORM
    // Taps lie at most r away, and half a pixel more if they are rounded; a vector stored in 8 bits
    // may be longer by half of a step, sqrt(2)/2 r/127.
    precise const float reach = 1.006 * float(uniforms.tile_px) + 1.0;
    precise const vec2 from = first - reach, to = last + reach;
    const ivec2 low = tile_of(from), high = tile_of(to);
#if SKY || DEPTH
    vec2 depths = texelFetch(tile_depth, low, 0).xy;
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            const vec2 tile = texelFetch(tile_depth, ivec2(x, y), 0).xy;
            depths = vec2(min(depths.x, tile.x), max(depths.y, tile.y));
        }
    }
#endif
#endif
#if UNIFORM
    // The v_max that its pixels choose are among them, and may come from farther away.
    vec4 range = chosen;
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            const vec4 tile = texelFetch(tile_range, ivec2(x, y), 0);
            range = vec4(min(range.xy, tile.xy), max(range.zw, tile.zw));
        }
    }
    precise const vec2 apart = range.zw - range.xy, middle = 0.5 * (range.xy + range.zw);
    bool alike = precise_length(apart) <= kAlike * precise_length(middle);
#if DEPTH
    precise const float layer = uniforms.depth_softness * (depths.y - depths.x);
    alike = alike && (layer == 0.0 || layer <= kAlike * depths.x);
#endif
    if (alike) {
        ADD_TO_WORK_LIST(uniform_blocks, at);
        return;
    }
#endif
#if SKY
    if (depths.x == depths.y) {
        ADD_TO_WORK_LIST(sky_blocks, at);
        return;
    }
#endif
    ADD_TO_WORK_LIST(full_blocks, at);
}
