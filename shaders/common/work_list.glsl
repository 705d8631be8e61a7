// Work lists: the blocks of 16 x 16 pixels that a step has to do. One step fills a list, a later
// one is launched indirectly with a work group for each block in it. Nothing is read back.
//
// The order of a list changes from run to run; no pixel may depend on it.
//
//   layout(std430, binding = 0) buffer StillBlocks { WORK_LIST } still_blocks;
//   ADD_TO_WORK_LIST(still_blocks, block)                     in the step that fills it
//   if (!take_work(still_blocks.count)) return;               in the step that it launches
//   ivec2 p = pixel_of_work(still_blocks.blocks[work_index()]);

const int kBlockPx = 16;
// Of the launch. A device may allow no more than 65535 groups a side, and the last row is launched
// in full whatever the list holds.
const uint kGroupsPerRow = 64u;

#define WORK_LIST   \
    uint groups_x;  \
    uint groups_y;  \
    uint groups_z;  \
    uint count;     \
    uint blocks[];

#define ADD_TO_WORK_LIST(list, block_xy)                                    \
    {                                                                       \
        const uint place = atomicAdd(list.count, 1u);                       \
        list.blocks[place] = uint((block_xy).x) | uint((block_xy).y) << 16; \
        atomicMax(list.groups_x, min(place + 1u, kGroupsPerRow));           \
        atomicMax(list.groups_y, place / kGroupsPerRow + 1u);               \
        list.groups_z = 1u;                                                 \
    }

uint work_index() {
    return gl_WorkGroupID.y * kGroupsPerRow + gl_WorkGroupID.x;
}

// The launch is a rectangle; its last row may be longer than the list.
bool take_work(uint count) {
    return work_index() < count;
}

ivec2 pixel_of_work(uint block_xy) {
    return kBlockPx * ivec2(block_xy & 0xffffu, block_xy >> 16) + ivec2(gl_LocalInvocationID.xy);
}
