// The report's filter, modes guertin and single: its steps.
#pragma once

#include "chain/pass.h"
#include "passes/motion_blur/parameters.h"

namespace postchain::motion_blur {

// Adds the steps and textures named in guertin.cpp.
void plan_guertin(const Parameters& parameters, PassPlanner& planner);
// Pass::shape and Pass::values of it.
ShapeNumbers guertin_shape(const Parameters& parameters, const PlanContext& context);
void write_guertin_values(const Parameters& parameters, const PlanContext& context,
                          UniformWriter& uniforms);

}  // namespace postchain::motion_blur
