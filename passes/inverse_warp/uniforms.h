// The uniform block of the inverse warp's steps, and what it and the steps both depend on.
#pragma once

#include "passes/inverse_warp/inverse_warp.h"
#include "shaders/shared/inverse_warp_uniforms.h"

namespace postchain::inverse_warp {

// True if surfaces hold their motion, and also the motion from the frame before.
bool holds_motion(const Settings& settings, const PlanContext& context);
// Does the pass use the layer behind? Not beside a hint that it is given: a step has too few
// textures for both, and that hint comes from a pass that has blurred the frame's color.
bool uses_second_layer(const Settings& settings, const PlanContext& context);
bool holds_motion_back(const Settings& settings, const PlanContext& context);

// The longest displacement, pixels: that the settings allow, and that the frame's bounds allow,
// which no surface exceeds. `back`: surfaces hold the motion from the frame before.
double longest_px(const Settings& settings);
double longest_px(const Settings& settings, const FrameDescription& frame, bool back);

// Blocks on each side whose surfaces can reach a block, for the longest path and radius.
int ring_of(double longest_px);

shared::InverseWarpUniforms uniforms_of(const Settings& settings, const FrameDescription& frame);

}  // namespace postchain::inverse_warp
