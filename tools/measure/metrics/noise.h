// How noisy a picture is, found from the picture alone, and which metrics that spoils.
//
//   r     = I * N / 6,  N = (1 -2 1; -2 4 -2; 1 -2 1): 0 where I is flat, a ramp, or an edge along
//   x
//           or y; of white noise of standard deviation s, r has s too
//   s     = median |r| of a tile / kNormalMedian: edges are few of its pixels, or leave half alone
//   s^2   is averaged over tiles: a picture is noisy in places
//
// Source: Immerkaer, "Fast Noise Variance Estimation", Computer Vision and Image Understanding
// 64(2), 1996, for N; he averages |r| over the picture, which edges enlarge. The median in its
// place: Donoho and Johnstone, "Ideal spatial adaptation by wavelet shrinkage", Biometrika 81(3),
// 1994. Fine texture counts as noise; noise that lies at edges alone, or that a denoiser has
// smeared over neighbors, is underestimated. docs/metrics.md has how far off it is on path-traced
// frames.
#pragma once

#include <map>
#include <string>

#include "tools/measure/metrics/pair.h"

namespace postchain::metrics {

inline constexpr int kNoiseTile = 8;                 // pixels
inline constexpr double kNormalMedian = 0.67448975;  // of |x|, x normal with deviation 1

// Variance of the noise around every pixel, the same in a tile. One channel; 0 in pictures below
// 3x3 pixels.
ImageF noise_variance(const ImageF& channel);

// What the noise of a truth does: its standard deviation (rms over pixels, of display_luma()), and
// by name what a picture without any error would score against this truth. Of the metrics for which
// that follows from the variance alone:
//   mse                 mean s^2 of linear RGB
//   psnr                of the mean s^2 of displayed RGB
//   edges_in_blurred, sharpness_in_focus     sharpness_without_error()
struct TruthNoise {
    double sigma = 0;
    std::map<std::string, double> of_no_error;
};
// `input`: the unfiltered picture, for the regions of the last two. Errors (input): sizes that
// differ.
Result<TruthNoise> truth_noise(const Picture& truth, const Picture& input);

}  // namespace postchain::metrics
