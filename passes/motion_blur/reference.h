// The motion blur in double precision on the CPU, to compare the GPU with.
#pragma once

#include "chain/pass/pass.h"
#include "passes/motion_blur/motion_blur.h"

namespace postchain::motion_blur {

// Reads color, motion and inverse_depth of frame.planes, replaces color, adds hint if
// context.wanted has it. Stages, each as the plan texture of that name: half_velocity (as stored),
// row_max, tile_max, neighbor_max, tile_variance and noise (when used), color, hint (when wanted).
void run_reference(const Parameters& parameters, const PlanContext& context, ReferenceFrame& frame);

}  // namespace postchain::motion_blur
