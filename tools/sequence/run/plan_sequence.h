// Plans each frame of a sequence; writes nothing.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/filter/layer_cost.h"
#include "tools/sequence/run/estimate.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/resolved_values.h"

namespace postchain::sequence {

struct PlannedFrame {
    int frame = 0;
    Result<Plan> plan;
    std::vector<std::string> warnings;
    Memory memory;                           // if there is a plan
    std::optional<ResolvedValues> resolved;  // if there is a plan: the values of its passes
    FrameLayers layers;
    std::optional<LayerCost> layer_cost;  // if there is a plan, and layers are filtered
};
// False ends the visit.
using PlanVisitor = std::function<bool(const PlannedFrame&)>;

// In the order of the frames. Errors (input): no frames; a frame's own errors are in its plan.
Status plan_sequence(const Chain& chain, const RunSettings& settings, const PlanVisitor& visitor);

// The plan of a frame that has one, with the keys `estimate`, `resolved` and `layer_cost`.
io::Json planned_json(const PlannedFrame& planned, const std::optional<Seconds>& seconds);

}  // namespace postchain::sequence
