// Warnings about a frame in view of the chain that will filter it.
#pragma once

#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// One line each, with the file: light lost at the border of a data window that is kept; streaks and
// circles of confusion that are cut, with the count of pixels and the largest; a focus in meters
// that a pass needs although the length of a scene unit is unknown.
std::vector<std::string> plan_warnings(const Chain& chain, const Plan& plan,
                                       const SourceFrame& frame);

}  // namespace postchain::sequence
