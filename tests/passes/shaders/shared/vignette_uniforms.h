// Uniform block of the vignette.
#ifndef POSTCHAIN_SHARED_VIGNETTE_UNIFORMS_H
#define POSTCHAIN_SHARED_VIGNETTE_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(VignetteUniforms)
    ivec2 size;      // of the frame, pixels
    float strength;  // light that the corners lose, 0..1
    int alpha;       // 1: alpha too
UNIFORMS_END

#ifdef __cplusplus
static_assert(sizeof(postchain::shared::VignetteUniforms) == 16);
#endif

#endif
