// Uniform block of every stage of the motion blur. Lengths in pixels.
#ifndef POSTCHAIN_SHARED_MOTION_BLUR_UNIFORMS_H
#define POSTCHAIN_SHARED_MOTION_BLUR_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(MotionBlurUniforms)
    ivec2 size;                   // of the image
    ivec2 tiles;                  // ceil(size / tile_px)
    int tile_px;                  // r: tile edge and largest half-velocity
    int samples;                  // N
    float half_shutter;           // 0.5 * shutter_frames: motion to half-velocity
    float still_limit_px;         // |v_max| up to which a pixel keeps its color
    float jitter;                 // h
    float tile_jitter_slope;      // tau
    float center_total;           // N / kappa
    float variance_threshold_px;  // gamma
    float depth_softness;         // s
    float pad0;
    float pad1;
    float pad2;
UNIFORMS_END

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::MotionBlurUniforms) == 64);
static_assert(offsetof(postchain::shared::MotionBlurUniforms, tiles) == 8);
static_assert(offsetof(postchain::shared::MotionBlurUniforms, tile_px) == 16);
static_assert(offsetof(postchain::shared::MotionBlurUniforms, jitter) == 32);
static_assert(offsetof(postchain::shared::MotionBlurUniforms, depth_softness) == 48);
#endif

#endif
