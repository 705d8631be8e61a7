// Work lists: the blocks of kBlockPx x kBlockPx pixels that a step has to do. One step fills a
// list, a later one is launched indirectly with a work group for each block in it. Nothing is read
// back. The host's side of it is chain/pass/work_list.h.
//
// The order of a list changes from run to run; no pixel may depend on it.
//
// A step that fills a list:
//
//   layout(std430, binding = 0) buffer StillBlocks { WORK_LIST } still_blocks;
//   ADD_TO_WORK_LIST(still_blocks, block)
//
// A step that may be launched by a list is compiled with LIST 0 (the whole frame) or 1:
//
//   ivec2 p;
//   if (!next_pixel(uniforms.size, p)) return;

#include "common/work_group.glsl"

#include "common/work_list_fill.glsl"

#ifdef LIST
#if LIST
layout(std430, binding = 0) readonly buffer WorkList { WORK_LIST } work_list;
#endif

// The place of this invocation in its block: eight invocations that follow one another do 4 x 2 pixels,
// 32 do 8 x 4. They run in step, and wait for each other less if their pixels are near each other.
ivec2 place_in_block() {
    const ivec2 id = ivec2(gl_LocalInvocationID.xy);
    return ivec2((id.x & 3) | (id.x >> 1 & 4) | (id.y << 1 & 8),
                 (id.x >> 2 & 1) | (id.y << 1 & 6) | (id.y & 8));
}

// The pixel of this invocation; false if it has none in a frame of this size.
bool next_pixel(ivec2 size, out ivec2 p) {
#if LIST
    // A launch by the list is a rectangle, whose last row may be longer than the list. Bands
    // (chain/plan/bands.h) lie in one row, which may be longer too, or in the rows of such a rectangle.
    const uvec2 group = uvec2(group_at());
    const uint index = group.y * uint(kGroupsPerRow) + group.x;
    if (index >= work_list.count) {
        p = ivec2(0);
        return false;
    }
    const uint block_xy = work_list.blocks[index];
    p = kBlockPx * ivec2(block_xy & 0xffffu, block_xy >> 16) + place_in_block();
#else
    p = kBlockPx * group_at() + place_in_block();
#endif
    return all(lessThan(p, size));
}
#endif
