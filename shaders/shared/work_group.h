// Work groups, and the blocks of work lists (common/work_list.glsl).
#ifndef POSTCHAIN_SHARED_WORK_GROUP_H
#define POSTCHAIN_SHARED_WORK_GROUP_H

#ifdef __cplusplus
namespace postchain::shared {
#endif
const int kBlockPx = 16;  // edge of a work group, and of a block, in pixels
// Width of a launch by a list. A device may allow no more than 65535 groups per side, and the last
// row is launched in full.
const int kGroupsPerRow = 64;
#ifdef __cplusplus
}  // namespace postchain::shared
#endif

#endif
