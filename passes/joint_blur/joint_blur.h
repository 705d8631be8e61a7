// Motion blur and depth of field in one: the mean over instants of the open shutter and points of
// the lens at once, by the inverse warp (passes/inverse_warp/inverse_warp.h). Two passes, one after
// the other, only approximate it: the second blurs what the first has smeared by one depth or
// motion.
#pragma once

#include "chain/pass.h"

namespace postchain::joint_blur {

// Its own rule of elision, of blocks that the device finds.
inline constexpr const char* kRuleUnblurredBlocks = "unblurred_blocks";

// Reads color, inverse_depth, motion and, where the frame has it, motion_back; writes color and,
// when a later pass reads it, hint.
const PassType& pass_type();

}  // namespace postchain::joint_blur
