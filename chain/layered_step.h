// A step that averages color and the extra layers: the weights are color's and are found once for
// several layers. The shader's side of it is shaders/common/layers.glsl.
#pragma once

#include <vector>

#include "chain/pass.h"

namespace postchain {

// Layers that one dispatch filters at most, beside color: their sums are held in registers.
inline constexpr int kLayersPerStep = 4;

// Adds `step`, which averages color. If the frame has extra layers the step also does the first of
// them, and steps for the other layers alone follow (they find the weights again). All of these
// have one program, whatever their number: the last one does some layers a second time. Macros:
// LAYERS, the number of a step's layers, and LAYERS_ONLY. `arrays`: bindings of layers, beside
// step.bindings. `taps`: fetches for each layer.
void add_layered_step(PassPlanner& planner, Step step, const std::vector<Binding>& arrays,
                      uint64_t taps);

}  // namespace postchain
