// Uniform block of the depth of field's search for the blocks of the downsampled image that are
// read.
#ifndef POSTCHAIN_SHARED_DEPTH_OF_FIELD_NEEDED_UNIFORMS_H
#define POSTCHAIN_SHARED_DEPTH_OF_FIELD_NEEDED_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(DepthOfFieldNeededUniforms)
    ivec2 blocks;         // of the downsampled image
    ivec2 reach;          // of the reader, in its own blocks on each side
    ivec2 reader_blocks;  // of the reader's plane
    int factor;           // edge of the reader's plane over that of the downsampled image
    int pad0;
UNIFORMS_END

#ifdef __cplusplus
static_assert(sizeof(postchain::shared::DepthOfFieldNeededUniforms) == 32);
static_assert(offsetof(postchain::shared::DepthOfFieldNeededUniforms, factor) == 24);
#endif

#endif
