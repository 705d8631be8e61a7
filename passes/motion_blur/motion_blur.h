// Motion blur after Guertin, McGuire, Nowrouzezahrai: "A Fast and Stable Feature-Aware Motion Blur
// Filter", NVIDIA NVR-2013-003, in the notation of McGuire et al. 2012. docs/motion_blur.md says
// how each ambiguity of the report is resolved.
#pragma once

#include "chain/pass.h"

namespace postchain::motion_blur {

// Its own rules of elision, for blocks that the device finds.
inline constexpr const char* kRuleStillBlocks = "still_blocks";
inline constexpr const char* kRuleSkyBlocks = "sky_blocks";
inline constexpr const char* kRuleUniformBlocks = "uniform_blocks";

// Reads color, motion and (unless depth_softness is 0) inverse_depth; writes color and, if a later
// pass reads it, hint.
const PassType& pass_type();

}  // namespace postchain::motion_blur
