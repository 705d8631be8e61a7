// Compares two images of the stability matrix: how much their pixels differ, and where.
#pragma once

#include <cstddef>
#include <string>

#include "chain/base/image.h"

namespace postchain::stress {

// Whether a pixel has equal bits in both.
bool equal_pixel(const ImageF& a, const ImageF& b, size_t pixel);

// The largest and the mean |value|.
double largest_of(const ImageF& image);
double mean_of(const ImageF& image);

// Per pixel, the largest |a - b| of its channels in units of `unit`.
ImageF changes_of(const ImageF& a, const ImageF& b, double unit);

// Per pixel the maximum over channels of |a - b| / max(|a|, |b|, floor), with the floor relative to
// the largest value of `input`; infinite if not finite.
ImageF errors_of(const ImageF& input, const ImageF& a, const ImageF& b);

// "at 3,4"
std::string place_of(const ImageF& image, size_t pixel);

}  // namespace postchain::stress
