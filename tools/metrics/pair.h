// Input of every metric: an image and its reference, of one size, finite, RGB.
//
//   ImageF (>= 3 channels, linear RGB first) --rgb_image_of--> RgbImage --pair_of--> Pair -->
//   metrics
//
// Non-finite components are replaced by 0 and their pixels counted here, so that metrics need no
// checks. Alpha is not compared.
#pragma once

#include <cstdint>

#include "chain/base/image.h"
#include "chain/base/status.h"

namespace postchain::metrics {

// Linear RGB without NaN or Inf, possibly negative.
struct RgbImage {
    ImageF rgb;              // pixels with a NaN or Inf component, replaced by 0
    uint64_t nonfinite = 0;  // pixels with a NaN or Inf component, which became 0
};

// Errors (input): no pixels, fewer than 3 channels.
Result<RgbImage> rgb_image_of(const ImageF& image);

// Composites premultiplied RGBA over this gray; alpha becomes 1.
void composite_over(ImageF& rgba, double gray);

struct Pair {
    RgbImage test;
    RgbImage reference;  // same size as `test`

    int width() const { return reference.rgb.width; }
    int height() const { return reference.rgb.height; }
    size_t pixels() const { return reference.rgb.pixels(); }
    const float* test_pixel(size_t i) const { return test.rgb.data.data() + 3 * i; }
    const float* reference_pixel(size_t i) const { return reference.rgb.data.data() + 3 * i; }
};

// Errors (input): those of rgb_image_of(); different sizes.
Result<Pair> pair_of(const ImageF& test, const ImageF& reference);
Result<Pair> pair_of(RgbImage test, RgbImage reference);

}  // namespace postchain::metrics
