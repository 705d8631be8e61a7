// Small passes for the planner's tests, each with one parameter, `off`: copy, blur (it moves color
// by 20 px), makes, carries and reads (FXAA's hint), spare (a step that nothing reads), before
// (reads the frame before).
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "chain/planner.h"

namespace postchain::test {

const ParameterTable& off_table();
const PassRegistry& small_passes();

// A chain of the passes of these names.
Chain chain_of(std::initializer_list<const char*> names);

// 40 x 30 pixels with color, inverse depth and motion.
FrameDescription frame();

// The plan for frame(); a failure fails the test.
Plan plan_of(const Chain& chain, const PlanOptions& options = {});

// "0.first", "0.second": pass and name of each step.
std::vector<std::string> steps_of(const Plan& plan);

}  // namespace postchain::test
