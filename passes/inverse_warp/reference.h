// The inverse warp in double precision on the CPU, the reference for the GPU's.
#pragma once

#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::inverse_warp {

// Replaces color of frame.planes; adds or replaces the hint if context.wanted has it.
void warp_reference(const PlanContext& context, const Settings& settings, ReferenceFrame& frame);

}  // namespace postchain::inverse_warp
