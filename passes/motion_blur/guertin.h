// The report's filter, modes guertin and single: its steps.
#pragma once

#include "chain/pass.h"
#include "passes/motion_blur/parameters.h"

namespace postchain::motion_blur {

// Adds the steps and textures named in guertin.cpp.
void plan_guertin(const Parameters& parameters, PassPlanner& planner);

}  // namespace postchain::motion_blur
