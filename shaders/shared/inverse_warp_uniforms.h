// Uniform block of every stage of the inverse warp (docs/inverse_warp.md). Lengths in pixels.
#ifndef POSTCHAIN_SHARED_INVERSE_WARP_UNIFORMS_H
#define POSTCHAIN_SHARED_INVERSE_WARP_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(InverseWarpUniforms)
ivec2 size;              // of the picture
ivec2 tiles;             // ceil(size / kBlockPx)
int ring;                // tiles on each side whose surfaces can reach a tile
int samples;             // per pixel; of the shutter alone: at most
float half_shutter;      // half the open time, frames; 1 where only the lens is open
float max_path_px;       // longest path on one side of the frame
float still_limit_px;    // displacements up to this leave the color as it is
float time_jitter;       // largest shift of a pixel's times, in spacings
float path_px_per_time;  // of the shutter alone: a pixel has a time for so many pixels of path
int lens_sets;           // of points of the lens
// circle of confusion: passes/common/circle_of_confusion.h
float gain_px;
float focus_inverse;
float near_sharp;
float near_inverse_span;
float far_sharp;
float far_inverse_span;
float near_radius_px;
float far_radius_px;
float max_radius_px;
float soft_spread;     // variance along x and y, px^2, from which on a sample is denoised
float denoise_window;  // weight of a pixel d away: exp(-window d^T covariance^-1 d)
float barrel_per_px;   // how far the barrel's circle is moved, radii per pixel from the middle
float barrel_scale;    // of points of the lens: 1 - barrel_per_px times the radius at infinity
float middle_x;        // of the picture, in pixels of the planes
float middle_y;
int more_samples;   // of tiles whose samples disagree, beyond `samples`; 0: of none
float noise_limit;  // mean squared difference of two halves of a tile's samples up to which
                    // it takes no more
float padding_0;
float padding_1;
UNIFORMS_END

// Pixels on each side that are denoised together.
#define INVERSE_WARP_DENOISE_REACH_PX 2

// Times of a pixel at least, however short its path.
#define INVERSE_WARP_LEAST_TIMES 5

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::InverseWarpUniforms) == 128);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, ring) == 16);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, still_limit_px) == 32);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, gain_px) == 48);
#endif

#endif
