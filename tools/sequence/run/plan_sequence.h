// What would run for each frame of a sequence; nothing is written.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

struct PlannedFrame {
    int frame = 0;
    Result<Plan> plan;
    std::vector<std::string> warnings;
};
// False ends it.
using PlanVisitor = std::function<bool(const PlannedFrame&)>;

// In the order of the frames. Errors (input): no frames; those of one frame are in its plan.
Status plan_sequence(const Chain& chain, const RunSettings& settings, const PlanVisitor& visitor);

}  // namespace postchain::sequence
