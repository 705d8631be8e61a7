// The steps of the inverse warp, which inverse_warp.h lists, and their uniform block.
#pragma once

#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::inverse_warp {

// The longest displacement that the settings allow, pixels.
double longest_px(const Settings& settings);
// Blocks on each side whose surfaces can reach a block, for this longest displacement.
int ring_of(double longest_px);

// Adds the steps with their textures, and hands on color, layers and the hint.
void add_steps(PassPlanner& planner, const Settings& settings);

// `neighbors`: searched_neighbors()
void write_step_uniforms(const Settings& settings, const FrameDescription& frame,
                         const NeighborList& neighbors, UniformWriter& writer);

}  // namespace postchain::inverse_warp
