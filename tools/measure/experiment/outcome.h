// What a report says of its variants as a whole: which one won, and which are no better than the
// unfiltered input.
#pragma once

#include "tools/measure/report/report.h"

namespace postchain::experiment {

// The metric that decides: what docs/metrics.md measures a picture as a whole by.
inline constexpr const char* kDecidingMetric = "hdr_flip";

// The truth is too noisy for a metric that is best at 1 when a picture without any error would be
// off by more than kNoiseShare, and for mse and psnr when the truth's noise is more than
// kNoiseOfError of the smallest MSE. docs/metrics.md has what the limits come from.
inline constexpr double kNoiseShare = 0.06;
inline constexpr double kNoiseOfError = 0.5;

// Fills in report.winner and adds to report.warnings; both need a truth. Means and, of ab, the
// comparison must be there.
//   ab: the one whose paired t-interval of HDR-FLIP says so. bench: the lowest mean HDR-FLIP of
//   those that did not fail.
//   A warning for variants whose mean HDR-FLIP, over the frames that they and the input have, is
//   not below the input's; from kFewFrames on also for those whose t-interval holds 0.
//   A warning for each metric that the truth is too noisy for.
void state_outcome(report::Report& report);

}  // namespace postchain::experiment
