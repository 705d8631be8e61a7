// Estimates the noise of an image from the image itself, and its effect on metrics.
//
//   r     = I * N / 6,  N = (1 -2 1; -2 4 -2; 1 -2 1): 0 where I is flat, a ramp, or an edge along
//           x or y; for white noise of standard deviation s, r also has s
//   s     = median |r| of a tile / kNormalMedian: robust while edges cover less than half of it
//   s^2   is averaged over tiles, because noise is often local
//
// Source: Immerkaer, "Fast Noise Variance Estimation", Computer Vision and Image Understanding
// 64(2), 1996, for N; it averages |r| over the image, which edges enlarge. The median instead:
// Donoho and Johnstone, "Ideal spatial adaptation by wavelet shrinkage", Biometrika 81(3), 1994.
// Fine texture is taken for noise. Noise only at edges, or smeared by a denoiser, is
// underestimated.
#pragma once

#include <map>
#include <string>

#include "tools/metrics/pair.h"

namespace postchain::metrics {

inline constexpr int kNoiseTile = 8;                 // pixels
inline constexpr double kNormalMedian = 0.67448975;  // median of |x|, x normal with deviation 1

// Noise variance at every pixel, constant in a tile. One channel; 0 in images below 3x3 pixels.
ImageF noise_variance(const ImageF& channel);

// Effect of the ground truth's noise: its standard deviation (rms over pixels, of display_luma()),
// and by metric the score of an error-free image against this ground truth, for the metrics where
// that follows from the variance:
//   mse                 mean s^2 of linear RGB
//   psnr                from the mean s^2 of displayed RGB
//   edges_in_blurred, sharpness_in_focus     sharpness_without_error()
struct TruthNoise {
    double sigma = 0;
    std::map<std::string, double> of_no_error;
};
// `input`: the unfiltered image, for the regions of the last two. Errors (input): different sizes.
Result<TruthNoise> truth_noise(const RgbImage& truth, const RgbImage& input);

}  // namespace postchain::metrics
