// Conclusions of a report: the winning variant, and the variants no better than the unfiltered
// input.
#pragma once

#include "tools/measure/report/report.h"

namespace postchain::experiment {

// The metric that decides; docs/metrics.md uses it for whole images.
inline constexpr const char* kDecidingMetric = "hdr_flip";

// The ground truth is too noisy for a metric that is best at 1 if an error-free image would deviate
// by more than kNoiseShare, and for mse and psnr if its noise is more than kNoiseOfError of the
// smallest MSE. docs/metrics.md derives the limits.
inline constexpr double kNoiseShare = 0.06;
inline constexpr double kNoiseOfError = 0.5;

// Sets report.winner and adds to report.warnings; both need a ground truth. Means must be set, and
// for ab the comparison.
// ab: the winner by the paired t-interval of HDR-FLIP. bench: the lowest mean HDR-FLIP of the
// variants that did not fail.
// Warns about variants whose mean HDR-FLIP, over frames they share with the input, is not below the
// input's; from kFewFrames frames on also about those whose t-interval contains 0.
//   Warns about each metric for which the ground truth is too noisy.
void state_outcome(report::Report& report);

}  // namespace postchain::experiment
