// Uniform block of the depth of field's Gaussian: one side of the kernel, four taps to a vec4.
#ifndef POSTCHAIN_SHARED_DEPTH_OF_FIELD_BLUR_UNIFORMS_H
#define POSTCHAIN_SHARED_DEPTH_OF_FIELD_BLUR_UNIFORMS_H

#include "shared/uniforms.h"

#define DEPTH_OF_FIELD_MAX_TAPS 1536  // one side; sigma 500 px at full size needs 1500

UNIFORMS_BEGIN(DepthOfFieldBlurUniforms)
    ivec2 size;  // of the downsampled image, pixels
    int quads;   // vec4s in use: ceil(taps / 4)
    int pad0;
    // weights[i/4][i%4] = exp(-(i+1)^2 / (2 sigma^2)), 0 beyond the last tap; the center weighs 1.
    vec4 weights[DEPTH_OF_FIELD_MAX_TAPS / 4];
UNIFORMS_END

#ifdef __cplusplus
static_assert(sizeof(postchain::shared::DepthOfFieldBlurUniforms) ==
              16 + 4 * DEPTH_OF_FIELD_MAX_TAPS);
static_assert(offsetof(postchain::shared::DepthOfFieldBlurUniforms, weights) == 16);
#endif

#endif
