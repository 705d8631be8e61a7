// Edges in blurred regions and sharpness in focus: measures the 2013 report's two claims about the
// order of depth of field and motion blur.
//
//   L  = luma after the display transform (display.h), of test, ground truth and unblurred input
//   g  = ((L(x+1,y) - L(x-1,y))/2)^2 + ((L(x,y+1) - L(x,y-1))/2)^2, edges replicated
//   e  = g smoothed by a Gaussian of kRegionSigma pixels
//   blurred: e(input) >= kMinEnergy and e(truth) <= kBlurredPart e(input)
//   sharp:   e(input) >= kMinEnergy and e(d) <= kOtherPart e(input), with the L of truth - input
//            in e(d). A limit on e(truth) alone counts the rims of highlights out of focus
//   value = (sum of e(test) + n kEnergyEpsilon) / (sum of e(truth) + n kEnergyEpsilon), over the n
//           pixels of a region, if these are at least kLeastRegion of the image
// The regions use the same e, so that the input itself reads at least 1 / kBlurredPart where the
// ground truth is blurred, and 0.6 .. 1.7 where it is sharp (except for the epsilon). The regions
// depend only on ground truth and input, so they are equal for all variants.
#pragma once

#include <optional>

#include "tools/metrics/pair.h"

namespace postchain::metrics {

inline constexpr double kRegionSigma = 3;       // pixels
inline constexpr double kMinEnergy = 5e-4;      // a step of 0.09 in L, at its foot
inline constexpr double kBlurredPart = 0.5;     // the ground truth lost at least half of the energy
inline constexpr double kOtherPart = 0.05;      // the ground truth shows the input's picture
inline constexpr double kLeastRegion = 0.005;   // of the image's pixels
inline constexpr double kEnergyEpsilon = 1e-6;  // per pixel: steps of 0.002 in L

struct Sharpness {
    // Relative to the ground truth; empty if it has no such region, or a smaller one.
    std::optional<double> edges_in_blurred;    // > 1: edges missing in the ground truth
    std::optional<double> sharpness_in_focus;  // < 1: softer than the ground truth
    size_t blurred_pixels = 0;
    size_t sharp_pixels = 0;
};

// `truth_pair`: test and ground truth; `input`: the unblurred image that was filtered. Errors
// (input): different sizes.
Result<Sharpness> sharpness(const Pair& truth_pair, const RgbImage& input);

// Value of an error-free test against a ground truth with white noise of this variance (noise.h, of
// display_luma(truth)). Noise of variance s^2 adds s^2 to the mean of g, so the test's e is the
// ground truth's minus s^2. 1 = the noise has no effect. Errors (input): different sizes.
Result<Sharpness> sharpness_without_error(const RgbImage& truth, const ImageF& variance,
                                          const RgbImage& input);

}  // namespace postchain::metrics
