// Motion blur and depth of field in one: the mean over shutter times and lens samples at once, by
// the inverse warp (passes/inverse_warp/inverse_warp.h). Two passes in sequence only approximate
// it: the second blurs each smeared pixel of the first by one depth or motion.
#pragma once

#include "chain/pass/pass.h"

namespace postchain::joint_blur {

// Its own rule of elision, for blocks that the device finds.
inline constexpr const char* kRuleUnblurredBlocks = "unblurred_blocks";

// Reads color, inverse_depth, motion and, if the frame has it, motion_back; writes color and, if a
// later pass reads it, hint.
const PassType& pass_type();

}  // namespace postchain::joint_blur
