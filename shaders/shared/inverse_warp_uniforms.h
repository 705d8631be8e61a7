// Uniform block of every stage of the inverse warp (docs/inverse_warp.md). Lengths in pixels.
#ifndef POSTCHAIN_SHARED_INVERSE_WARP_UNIFORMS_H
#define POSTCHAIN_SHARED_INVERSE_WARP_UNIFORMS_H

#include "shared/small_circles.h"
#include "shared/uniforms.h"

UNIFORMS_BEGIN(InverseWarpUniforms)
ivec2 size;              // of the frame
ivec2 blocks;            // ceil(size / kBlockPx)
int starts;              // start surfaces of a block, at most
int samples;             // per pixel; of the shutter alone: an upper limit
float half_shutter;      // half the open time, frames; 1 if only the lens is open
float max_path_px;       // longest path on one side of the frame
float still_limit_px;    // displacements up to this leave the color as it is
float time_jitter;       // largest shift of a pixel's time samples, in spacings
float path_px_per_time;  // of the shutter alone: pixels of path per time sample
int lens_sets;           // number of sets of lens samples
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
float soft_spread;     // samples are denoised from this variance along x and y on, px^2
float denoise_window;  // weight of a pixel d away: exp(-window d^T covariance^-1 d)
float barrel_per_px;   // shift of the barrel's circle, radii per shorter side of a pixel
float barrel_scale;    // of lens samples: 1 - barrel_per_px times the radius at infinity
float center_x;        // of the frame, in pixels of the planes
float center_y;
float pixel_axis_x;  // pixels as long as the shorter side of a pixel: 1, 1 for square ones
float pixel_axis_y;
int fill_layer;  // which of the frame's layers is the fill mask (chain/frame/layers.h); -1: none
// of the step: uniforms, so that both neighbors have one program
int neighbor;     // -1: planes of the frame before, 1: of the frame after
int second_half;  // 1: its surfaces are the second half of their texture
// Times are time_shift + time_scale u of those of a shutter that is centered on the frame.
float time_scale;
float time_shift;
float disc_scale;  // radius of the disc that a round aperture blurs like, in its own; 0: not round
float pad0;
// shared/small_circles.h. Not a constant of the program: a GPU may keep that in memory.
vec4 circle_weights[SMALL_CIRCLES_VECTORS];
UNIFORMS_END

// Pixels on each side that are denoised together.
#define INVERSE_WARP_DENOISE_REACH_PX 2

// Edge of a work group of start_choice.glsl, in blocks.
#define INVERSE_WARP_STARTS_BLOCKS 8

// Edge of the squares of pixels that a thread packs.
#define INVERSE_WARP_SQUARE_PX 4

// Edge of the patches in which the light of two frames is compared.
#define INVERSE_WARP_LIGHT_PATCH_PX 8

// Minimum of a pixel's time samples, however short its path.
#define INVERSE_WARP_MIN_TIMES 5

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::InverseWarpUniforms) == 144 + 16 * SMALL_CIRCLES_VECTORS);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, circle_weights) == 144);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, starts) == 16);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, still_limit_px) == 32);
static_assert(offsetof(postchain::shared::InverseWarpUniforms, gain_px) == 48);
#endif

#endif
