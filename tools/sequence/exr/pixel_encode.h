// Converts float pixels to planes of a file: deinterleaved, in the channel's type, checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/exr/write_options.h"

namespace postchain::io {

struct EncodeTarget {
    const ImageF* image = nullptr;
    int index = 0;  // channel of the image
    PixelType type = PixelType::half;
    std::byte* bytes = nullptr;  // width * height values, row 0 first
    bool finite = false;         // replace Inf and NaN in float channels too
};

struct EncodeCounts {
    uint64_t overflow_pixels = 0;   // finite, beyond the half range, in a half channel
    uint64_t nonfinite_pixels = 0;  // NaN or Inf, in any channel
    uint64_t refused_pixels = 0;    // either of them in a half or `finite` channel
    bool narrowed = false;          // float channels are written as half
};

// Encodes channels of images of one size. Half: rounded to nearest even, clamped to +-kMaxHalf (Inf
// too), NaN becomes 0; check_counts() decides whether that is acceptable. Float: unchanged, or with
// `finite` the largest float for Inf and 0 for NaN. Uint: rounded, clamped to 0..2^32-1, NaN
// becomes 0.
EncodeCounts encode_channels(const std::vector<EncodeTarget>& targets);

// With `refuse`: an error (output) with `path` and the counts, if any pixel was refused.
Status check_counts(const std::string& path, const EncodeCounts& counts, HalfOverflow policy);

// 16-bit patterns of `count` floats, rounded to the nearest: IEEE 754 binary16. Values that are too
// large become infinite, NaN stays NaN.
void floats_to_halves(const float* from, size_t count, uint16_t* to);
void halves_to_floats(const uint16_t* from, size_t count, float* to);

}  // namespace postchain::io
