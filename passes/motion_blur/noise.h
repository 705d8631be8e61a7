// Random numbers of the motion blur: two per pixel, independent of each other, from tables of
// 128 x 128 pixels that repeat over the picture. Same seed, same table.
//
//   x: tile value in [0, 1), decides whether a pixel takes the neighboring tile
//   y: tap value in [-1, 1), shifts its taps
//
//   halton  radical inverses in base 2 and 3 of the pixel's index in Morton order (x in the even
//           bits): any 2^k x 2^k square of the picture holds an even spread of the first value
//   ign     J. Jimenez' interleaved gradient noise, fract(52.9829189 fract(0.06711056 x +
//           0.00583715 y)), evaluated in 0.32 fixed point so that every machine agrees; the tap
//           value takes the axes the other way round
//   blue    ranks of a 64 x 64 void-and-cluster pattern (R. Ulichney, 1993); the tap value reads
//           the pattern elsewhere
//
// seed and frame number shift the pattern by whole pixels.
#pragma once

#include <array>
#include <cstdint>

#include "chain/image.h"
#include "chain/pass.h"
#include "passes/motion_blur/parameters.h"

namespace postchain::motion_blur {

inline constexpr int kNoiseSize = 128;
inline constexpr int kBlueNoiseSize = 64;

// Shift of the pattern, 0..127 in each axis: {0, 0} for seed 0 without animation.
std::array<int, 2> noise_shift(const Parameters& parameters, int frame_number);

// Rank 0..4095 of each pixel of the blue noise pattern, row-major; made on first use (about 50 ms),
// in integers, so that it is the same on every machine.
const std::array<uint16_t, kBlueNoiseSize * kBlueNoiseSize>& blue_noise_ranks();

// Adds the texture "noise" and the step that fills it; -1 for Noise::none. `used`: whether the
// filter reads it with these parameters.
TextureId add_noise(PassPlanner& planner, const Parameters& parameters, bool used);

// The whole table: 128 x 128, two channels. `noise` is not Noise::none.
ImageD noise_table(Noise noise, std::array<int, 2> shift);

}  // namespace postchain::motion_blur
