// A step that averages color, for the further layers too: the weights are color's and are found
// once for several layers. The shader's side of it is shaders/common/layers.glsl.
#pragma once

#include <vector>

#include "chain/pass.h"

namespace postchain {

// Layers that one dispatch filters at most, beside color: their sums are held in registers.
inline constexpr int kLayersPerStep = 4;

// Adds `step`, which averages color. Where the frame has further layers it does the first of them
// besides, and is followed by steps that do the others and nothing else (they repeat how the
// weights are found): macros LAYERS, how many, LAYERS_FIRST, the first of them, and LAYERS_ONLY.
// `arrays`: what it reads and writes of layers, beside step.bindings. `taps`: fetches for each
// layer.
void add_layered_step(PassPlanner& planner, Step step, const std::vector<Binding>& arrays,
                      uint64_t taps);

}  // namespace postchain
