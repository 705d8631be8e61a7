#version 450 core
// Chooses the start surfaces of each block, from which a search starts after the pixel's own, among those that
// row_starts.comp has chosen in the blocks of its column (start_choice.glsl), and lists the blocks in which
// nothing moves.
//
//   row_starts -> starts   nearest first, (STARTS + 1) blocks.x by blocks.y; the last texel of a block: x bits
//                          of the longest path that reaches it, px; y number of start surfaces
//              -> work lists of blocks: still, moving (LISTS)
const int kAxis = 1;
#include "common/work_list_fill.glsl"

#include "inverse_warp/start_choice.glsl"

layout(binding = 0) writeonly uniform uimage2D starts;
#if LISTS
layout(std430, binding = 0) buffer MovingBlocks { WORK_LIST } moving_blocks;
layout(std430, binding = 1) buffer StillBlocks { WORK_LIST } still_blocks;
#endif

// The number of chosen surfaces that are nearer than surface i; on a tie, the one chosen first is
// nearer.
int place_of(int i, Starts chosen) {
    const float q = chosen.surface[i].inverse_depth;
    int place = 0;
    for (int j = 0; j < STARTS; ++j) {
        const float r = chosen.surface[j].inverse_depth;
        if (j < chosen.count && (r > q || (r == q && j < i))) ++place;
    }
    return place;
}

void store_starts(Starts chosen, ivec2 block) {
    const ivec2 first = ivec2((STARTS + 1) * block.x, block.y);
    for (int i = 0; i < STARTS; ++i)
        if (i < chosen.count && is_mine(i))
            imageStore(starts, first + ivec2(place_of(i, chosen), 0),
                       texelFetch(given, chosen.texel[i], 0));
    if (!is_mine(0)) return;
    imageStore(starts, first + ivec2(STARTS, 0),
               uvec4(floatBitsToUint(chosen.longest_px), uint(chosen.count), 0u, 0u));
#if LISTS
    if (chosen.longest_px <= uniforms.still_limit_px)
        ADD_TO_WORK_LIST(still_blocks, block)
    else
        ADD_TO_WORK_LIST(moving_blocks, block)
#endif
}

void main() {
    const ivec2 reaching = find_reaching();
    const ivec2 block = invocation_at() / ivec2(kSharers, 1);
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    store_starts(choose_all(block, reaching), block);
}
