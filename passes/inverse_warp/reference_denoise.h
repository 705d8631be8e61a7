// Noise of few samples, for the inverse warp's double-precision reference: what of a pixel's
// samples is blurred, and how pixels share it. Written from docs/inverse_warp.md.
#pragma once

#include <array>
#include <vector>

#include "chain/image.h"
#include "passes/inverse_warp/inverse_warp.h"
#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

// Of one pixel's samples those that are blurred.
struct Soft {
    std::vector<double> sum;  // of differences to the pixel's own color, as wide as it is
    double weight = 0;
    std::array<double, 3> spread = {};  // sum of covariances: xx, xy, yy, px^2

    // A sample that has seen a surface of this inverse depth and path on one side of the frame.
    void add(const Settings& settings, const std::vector<double>& difference, double inverse_depth,
             Vec path, double sample_weight);
};

// Each pixel of `color` gets its share of what blurred samples have seen around it. seen: their
// mean color, as wide as `color`; share: their share; spread: their covariance, xx, xy, yy.
void denoise(const Settings& settings, const ImageD& seen, const ImageD& share,
             const ImageD& spread, ImageD& color);

}  // namespace postchain::inverse_warp::reference
