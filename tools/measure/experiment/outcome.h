// What a report says of its variants as a whole: which one won, and which are no better than the
// unfiltered input.
#pragma once

#include "tools/measure/report/report.h"

namespace postchain::experiment {

// The metric that decides: what docs/metrics.md measures a picture as a whole by.
inline constexpr const char* kDecidingMetric = "hdr_flip";

// Fills in report.winner and adds to report.warnings; both need a truth. Means and, of ab, the
// comparison must be there.
//   ab: the one whose paired t-interval of HDR-FLIP says so. bench: the lowest mean HDR-FLIP of
//   those that did not fail.
//   A warning for variants whose mean HDR-FLIP, over the frames that they and the input have, is
//   not below the input's; from kFewFrames on also for those whose t-interval holds 0.
void state_outcome(report::Report& report);

}  // namespace postchain::experiment
