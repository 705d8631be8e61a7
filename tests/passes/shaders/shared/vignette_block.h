// Uniform block of the vignette.
#ifndef POSTCHAIN_SHARED_VIGNETTE_BLOCK_H
#define POSTCHAIN_SHARED_VIGNETTE_BLOCK_H

#include "shared/block.h"

BLOCK_BEGIN(VignetteBlock)
    ivec2 size;      // of the picture, pixels
    float strength;  // light that the corners lose, 0..1
    int alpha;       // 1: alpha too
BLOCK_END

#ifdef __cplusplus
static_assert(sizeof(postchain::shared::VignetteBlock) == 16);
#endif

#endif
