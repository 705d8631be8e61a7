// The cost of a frame's extra layers and filtered cryptomattes, from its plans.
#pragma once

#include <optional>
#include <string>

#include "tools/sequence/files/json.h"
#include "tools/sequence/filter/cryptomatte_filter.h"

namespace postchain::sequence {

struct LayerCost {
    int layers = 0;           // those of ids included
    size_t ids = 0;           // of cryptomattes
    int runs = 0;             // of the chain
    size_t dispatches = 0;    // of all runs
    uint64_t peak_bytes = 0;  // textures of the largest run
    double fetches = 0;       // of all runs, in those of color alone; layers that are 0 cost less
};

// `plan`: the frame's plan. Empty if only color is filtered. Errors: those of make_plan().
Result<std::optional<LayerCost>> layer_cost(const Chain& chain, const Plan& plan,
                                            const SourceFrame& frame, const PlanOptions& options);

io::Json layer_cost_json(const LayerCost& cost);
// A line to read.
std::string layer_cost_text(const LayerCost& cost);

}  // namespace postchain::sequence
