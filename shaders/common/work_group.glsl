// The work group of nearly every step: kBlockPx x kBlockPx invocations, one per pixel.
#include "shared/work_group.h"

layout(local_size_x = kBlockPx, local_size_y = kBlockPx) in;

#include "common/first_group.glsl"
