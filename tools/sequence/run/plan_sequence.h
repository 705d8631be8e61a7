// What would run for each frame of a sequence; nothing is written.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/run/estimate.h"
#include "tools/sequence/run/resolved.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

struct PlannedFrame {
    int frame = 0;
    Result<Plan> plan;
    std::vector<std::string> warnings;
    Memory memory;                     // where there is a plan, as the next
    std::optional<Resolved> resolved;  // what its passes work with
    FrameLayers layers;
};
// False ends it.
using PlanVisitor = std::function<bool(const PlannedFrame&)>;

// In the order of the frames. Errors (input): no frames; those of one frame are in its plan.
Status plan_sequence(const Chain& chain, const RunSettings& settings, const PlanVisitor& visitor);

// The plan of a frame that has one, with its `estimate` and `resolved`.
io::Json planned_json(const PlannedFrame& planned, const std::optional<Seconds>& seconds);

}  // namespace postchain::sequence
