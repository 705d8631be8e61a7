// Small passes for the planner's tests, each with one parameter, `off`: copy, blur (it moves color
// by 20 px), makes, carries and reads (FXAA's hint), spare (a step that nothing reads), before
// (reads the frame before), blur_before (both), forgets (to fill a uniform block).
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "chain/pass/planner.h"

namespace postchain::test {

const PassRegistry& small_passes();

// A chain of the passes of these names.
Chain chain_of(std::initializer_list<const char*> names);

// 40 x 30 pixels with color, inverse depth and motion.
FrameDescription frame();

// The chain with one of its passes off.
Chain with_off(Chain chain, size_t pass);

// A failure fails the test.
Plan plan_of(const Chain& chain, const PlanOptions& options = {},
             const FrameDescription& described = frame());

// "0.first", "0.second": pass and name of each step.
std::vector<std::string> steps_of(const Plan& plan);

}  // namespace postchain::test
