// Random numbers: two per pixel, independent of each other, from tables of 128 x 128 pixels that
// repeat over the frame. Same seed, same table.
//
//   x: tile value in [0, 1): whether a pixel takes the neighboring tile, which lens samples
//   y: tap value in [-1, 1): shifts its taps or times
//
//   halton  radical inverses in base 2 and 3 of the pixel's index in Morton order (x in the even
//           bits): any 2^k x 2^k square of the image holds an even spread of the first value
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

#include "chain/base/image.h"
#include "chain/pass/pass.h"

namespace postchain::noise {

enum class Kind { halton, ign, blue, none };

struct Parameters {
    Kind noise = Kind::halton;
    int seed = 0;
    bool animate_noise = false;
};

// Rows for the table of a pass that needs random numbers.
const ParameterTable& parameter_table();

inline constexpr int kSize = 128;
inline constexpr int kBlueSize = 64;

// Shift of the pattern, 0..127 in each axis: {0, 0} for seed 0 without animation.
std::array<int, 2> shift_of(const Parameters& parameters, int frame_number);

// Rank 0..4095 of each pixel of the blue noise pattern, row-major; made on first use (about 50 ms),
// in integers, so that every machine makes the same pattern.
const std::array<uint16_t, kBlueSize * kBlueSize>& blue_ranks();

// Adds the texture "noise" and the step that fills it; -1 for Kind::none.
TextureId add_table(PassPlanner& planner, const Parameters& parameters);

// Fills the uniform block of that step.
void write_uniforms(const Parameters& parameters, int frame_number, UniformWriter& uniforms);

// The whole table: 128 x 128, two channels; empty for Kind::none.
ImageD table(const Parameters& parameters, int frame_number);

}  // namespace postchain::noise
