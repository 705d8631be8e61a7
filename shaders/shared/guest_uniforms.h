// Uniform block of the steps between a host's textures and the canonical planes.
#ifndef POSTCHAIN_SHARED_GUEST_UNIFORMS_H
#define POSTCHAIN_SHARED_GUEST_UNIFORMS_H

#include "shared/uniforms.h"

#define GUEST_MAKES_COLOR 1
#define GUEST_MAKES_DEPTH 2
#define GUEST_MAKES_MOTION 4
#define GUEST_MAKES_SKY 8      // motion of infinitely far pixels without a vector
#define GUEST_READS_DEPTH 16   // the host's depth is bound
#define GUEST_FINDS_MOTION 32  // motion has fewer texels than depth, which chooses among them

// Bits of the macro ARRAYS: the host's textures that are arrays.
#define GUEST_ARRAY_COLOR 1
#define GUEST_ARRAY_DEPTH 2
#define GUEST_ARRAY_MOTION 4
#define GUEST_ARRAY_MASK 8

#define GUEST_FOCUS_PLACES 4

UNIFORMS_BEGIN(GuestUniforms)
ivec2 size;      // of the planes that passes see
ivec2 color_at;  // where its first stored texel is in each texture
ivec2 depth_at;
ivec2 motion_at;
ivec2 exposure_at;
ivec2 output_at;
int bottom_up;  // 1: the first stored row is the bottom one
int distance;   // 1: depth is a distance; 0: 1/d = depth_offset + depth_slope * stored
float depth_offset;
float depth_slope;
vec2 motion_scale;  // (stored - motion_bias) * motion_scale - motion_jitter: texels as stored
vec2 motion_bias;
vec2 motion_jitter;
float gain;      // of color, besides the exposure
float sky_sign;  // of the way to where a direction is in the other frame
vec4 sky_x;      // rows of (x, y, 1) -> (x, y, w) of the other frame; x, y of clip space
vec4 sky_y;
vec4 sky_w;
ivec2 shown_size;  // of the texture that a debug view draws
int makes;         // GUEST_MAKES_...: the planes that the import makes
int pad0;
ivec2 shown_at;     // its first stored texel, if it is the host's
ivec2 shown_image;  // its slice and level, likewise
ivec4 slices;       // of color, depth, motion, mask
ivec4 levels;
ivec2 depth_size;  // texels of the frame's rectangle
ivec2 motion_size;
ivec2 mask_at;
ivec2 full_size;  // of the frame; with PC_HALF_RESOLUTION twice `size`, or one less
ivec2 pad1;
float depth_first;  // stored depth, less this, times depth_factor, is in 0..1 if clips
float depth_factor;
int clips;         // 1: stored depths outside the range count as its ends
float output_max;  // largest value that the output holds
int focus_slot;    // place of this frame's values in the buffer
int focus_count;
ivec4 focus[GUEST_FOCUS_PLACES];  // pixel, and the radius around it in pixels; 0: 5 x 5 pixels
UNIFORMS_END

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::GuestUniforms) == 336);
static_assert(offsetof(postchain::shared::GuestUniforms, bottom_up) == 48);
static_assert(offsetof(postchain::shared::GuestUniforms, motion_scale) == 64);
static_assert(offsetof(postchain::shared::GuestUniforms, gain) == 88);
static_assert(offsetof(postchain::shared::GuestUniforms, sky_x) == 96);
#endif

#endif
