// Fills work lists, in a step with a work group of its own. Lists: work_list.glsl.
//
// One atomic per block: the launch's size changes only with the first block of a row, and its width
// with those of the first row.

// Width of the launch. A device may allow no more than 65535 groups per side, and the last row is
// launched in full.
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
        if (place < kGroupsPerRow) atomicMax(list.groups_x, place + 1u);    \
        if (place % kGroupsPerRow == 0u) {                                  \
            atomicMax(list.groups_y, place / kGroupsPerRow + 1u);           \
            list.groups_z = 1u;                                             \
        }                                                                   \
    }
