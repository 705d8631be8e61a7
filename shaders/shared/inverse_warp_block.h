// Uniform block of every stage of the inverse warp (docs/inverse_warp.md). Lengths in pixels.
#ifndef POSTCHAIN_SHARED_INVERSE_WARP_BLOCK_H
#define POSTCHAIN_SHARED_INVERSE_WARP_BLOCK_H

#include "shared/block.h"

BLOCK_BEGIN(InverseWarpBlock)
    ivec2 size;            // of the picture
    ivec2 tiles;           // ceil(size / kBlockPx)
    int ring;              // tiles on each side whose surfaces can reach a tile
    int samples;           // times per pixel at most
    float half_shutter;    // half the open time, frames
    float max_path_px;     // longest path on one side of the frame
    float still_limit_px;  // paths up to this leave the color as it is
    float time_jitter;     // largest shift of a pixel's times, in spacings
    float path_px_per_time;  // a pixel has a time for so many pixels of path
    float pad0;
BLOCK_END

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::InverseWarpBlock) == 48);
static_assert(offsetof(postchain::shared::InverseWarpBlock, ring) == 16);
static_assert(offsetof(postchain::shared::InverseWarpBlock, still_limit_px) == 32);
#endif

#endif
