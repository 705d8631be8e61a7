// The steps of the inverse warp: inverse_warp.h lists them.
#pragma once

#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::inverse_warp {

// Adds them with their textures, and hands on color, layers and the hint.
void add_steps(PassPlanner& planner, const Settings& settings);

}  // namespace postchain::inverse_warp
