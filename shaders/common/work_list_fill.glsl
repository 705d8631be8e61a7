// Fills work lists, in a step with a work group of its own. Lists: work_list.glsl.
//
// One atomic per block: the launch's size changes only with the first block of a row, and its width
// with those of the first row.
#include "shared/work_group.h"

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
        const uint row = uint(kGroupsPerRow);                               \
        if (place < row) atomicMax(list.groups_x, place + 1u);              \
        if (place % row == 0u) {                                            \
            atomicMax(list.groups_y, place / row + 1u);                     \
            atomicMax(list.groups_z, 1u);                                   \
        }                                                                   \
    }
