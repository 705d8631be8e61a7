// The inverse warp in double precision on the CPU, to hold the GPU against.
#pragma once

#include "passes/common/inverse_warp.h"

namespace postchain::inverse_warp {

// Replaces color of frame.planes, adds hint where context.wanted has
// it. `noise`: two channels of 128 x 128 pixels; null: no shift.
void shutter_reference(const PlanContext& context, const ShutterSettings& settings,
                       const ImageD* noise, ReferenceFrame& frame);

}  // namespace postchain::inverse_warp
