// Denoising in the inverse warp's double-precision reference (denoise.comp). Written from
// docs/inverse_warp.md.
#pragma once

#include "chain/image.h"
#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::inverse_warp::reference {

constexpr double kPixelVariance = 1.0 / 12;  // px^2, along x and y, added to each covariance

// Replaces, in each pixel of `color`, the part that blurred samples have by their mean over the
// pixels around. soft: their mean color, as wide as `color`; share: their share; spread: their
// covariance, xx, xy, yy.
void denoise(const Settings& settings, const ImageD& soft, const ImageD& share,
             const ImageD& spread, ImageD& color);

}  // namespace postchain::inverse_warp::reference
