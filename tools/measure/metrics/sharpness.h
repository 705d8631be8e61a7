// Edges in blurred regions and sharpness in focus: the 2013 report's two claims about the order of
// depth of field and motion blur, as numbers.
//
//   L  = luma after the display transform (display.h), of test, truth, and the unblurred input
//   g  = ((L(x+1,y) - L(x-1,y))/2)^2 + ((L(x,y+1) - L(x,y-1))/2)^2, edges replicated
//   e  = g smoothed by a Gaussian of kRegionSigma pixels
//   blurred: e(input) >= kMinEnergy and e(truth) <= kBlurredPart e(input)
//   sharp:   e(input) >= kMinEnergy and kSharpPart <= e(truth) / e(input) <= 1 / kSharpPart
//   value = (sum of e(test) + n kEnergyEpsilon) / (sum of e(truth) + n kEnergyEpsilon), over the n
//           pixels of a region
// By the same e as the regions, so that the input itself reads at least 1 / kBlurredPart where the
// truth is blurred, and kSharpPart .. 1 / kSharpPart where it is sharp (but for the epsilon).
// Which pixels are blurred and which are sharp depends on truth and input alone, so it is the same
// for every variant.
#pragma once

#include <optional>

#include "tools/measure/metrics/pair.h"

namespace postchain::metrics {

inline constexpr double kRegionSigma = 3;       // pixels
inline constexpr double kMinEnergy = 5e-4;      // a step of 0.09 in L, seen at its foot
inline constexpr double kBlurredPart = 0.5;     // the truth lost half of the energy or more
inline constexpr double kSharpPart = 0.8;       // the truth kept it within a fifth
inline constexpr double kEnergyEpsilon = 1e-6;  // per pixel: steps of 0.002 in L

struct Sharpness {
    // Relative to the truth; nothing when the truth has no such region.
    std::optional<double> edges_in_blurred;    // > 1: edges that the truth does not show
    std::optional<double> sharpness_in_focus;  // < 1: softer than the truth
    size_t blurred_pixels = 0;
    size_t sharp_pixels = 0;
};

// `truth_pair`: the test and the truth; `input`: the unblurred picture that was filtered. Errors
// (input): sizes that differ.
Result<Sharpness> sharpness(const Pair& truth_pair, const Picture& input);

// What a test without any error would read against a truth with white noise of this variance
// (noise.h, of display_luma(truth)): noise of variance s^2 adds s^2 to the mean of g, so the test's
// e is the truth's less s^2. 1: the noise does not matter. Errors (input): sizes that differ.
Result<Sharpness> sharpness_without_error(const Picture& truth, const ImageF& variance,
                                          const Picture& input);

}  // namespace postchain::metrics
