// Uniform block of the depth of field's coc, downsample and composite stages.
#ifndef POSTCHAIN_SHARED_DEPTH_OF_FIELD_UNIFORMS_H
#define POSTCHAIN_SHARED_DEPTH_OF_FIELD_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(DepthOfFieldUniforms)
    ivec2 size;      // of the image, pixels
    ivec2 low_size;  // of the downsampled image, pixels
    // lens: R = gain_px (focus_inverse - w)
    float gain_px;        // pixels times scene units
    float focus_inverse;  // 1/scene units
    // planes and range: ramps in d, scene units
    float near_sharp;
    float near_inverse_span;
    float far_sharp;
    float far_inverse_span;
    float near_radius_px;
    float far_radius_px;
    float max_radius_px;
    float full_blur_px;  // |R| from which on only the blurred image shows
    float pad0;
    float pad1;
UNIFORMS_END

#ifdef __cplusplus
static_assert(sizeof(postchain::shared::DepthOfFieldUniforms) == 64);
static_assert(offsetof(postchain::shared::DepthOfFieldUniforms, gain_px) == 16);
static_assert(offsetof(postchain::shared::DepthOfFieldUniforms, max_radius_px) == 48);
#endif

#endif
