// The work group of nearly every step of a pass: one invocation for a pixel, kBlockPx x kBlockPx of
// them.
#include "shared/work_group.h"

layout(local_size_x = kBlockPx, local_size_y = kBlockPx) in;
