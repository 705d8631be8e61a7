// Edge of a work group, and of the blocks in a work list (common/work_list.glsl), in pixels.
#ifndef POSTCHAIN_SHARED_WORK_GROUP_H
#define POSTCHAIN_SHARED_WORK_GROUP_H

#ifdef __cplusplus
namespace postchain::shared {
#endif
const int kBlockPx = 16;
#ifdef __cplusplus
}  // namespace postchain::shared
#endif

#endif
