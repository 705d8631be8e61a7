#include "tools/sequence/filter/layer_cost.h"

#include <algorithm>
#include <cstdio>

#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

uint64_t taps_of(const Plan& plan) {
    uint64_t taps = 0;
    for (const Step& step : plan.steps) taps += step.taps;
    return taps;
}

FrameDescription without_layers(FrameDescription description) {
    for (const Role role : {Role::layers, Role::layers_before, Role::layers_after})
        description.planes.remove(role);
    description.layers = 0;
    return description;
}

}  // namespace

Result<std::optional<LayerCost>> layer_cost(const Chain& chain, const Plan& plan,
                                            const SourceFrame& frame, const PlanOptions& options) {
    const std::vector<CoverageRun> coverage = coverage_runs(chain, plan, frame, options);
    if (coverage.empty() && frame.layers.filtered.empty()) return std::optional<LayerCost>();
    const FrameDescription description = planned_description(chain, frame);
    ASSIGN_OR_RETURN(const auto alone, make_plan(chain, without_layers(description), options));
    LayerCost cost;
    cost.layers = int(frame.layers.filtered.size());
    uint64_t taps = 0;
    const auto add = [&](const Plan& run) {
        ++cost.runs;
        cost.dispatches += run.steps.size();
        cost.peak_bytes = std::max(cost.peak_bytes, run.peak_bytes());
        taps += taps_of(run);
    };
    bool with_color = false;
    for (const CoverageRun& run : coverage) {
        with_color = with_color || run.with_color;
        cost.layers += run.layers();
        for (const CoverageSlot& slot : run.slots) cost.ids += slot.ids.size();
        ASSIGN_OR_RETURN(const auto planned,
                         make_plan(chain, described(run, frame, description), options));
        add(planned);
    }
    if (!with_color) add(plan);
    for (const LayersApart& group : frame.layers_apart) {
        FrameDescription apart = without_layers(description);
        for (const auto& [role, plane] : group.planes) apart.planes.add(role);
        apart.layers = int(group.layers.size());
        ASSIGN_OR_RETURN(const auto planned, make_plan(chain, apart, options));
        add(planned);
    }
    cost.fetches = double(taps) / double(std::max<uint64_t>(taps_of(alone), 1));
    return std::optional(cost);
}

io::Json layer_cost_json(const LayerCost& cost) {
    return {{"layers", cost.layers},
            {"ids", cost.ids},
            {"runs", cost.runs},
            {"dispatches", cost.dispatches},
            {"peak_bytes", cost.peak_bytes},
            {"fetches", cost.fetches}};
}

std::string layer_cost_text(const LayerCost& cost) {
    char fetches[32];
    std::snprintf(fetches, sizeof(fetches), "%.1f", cost.fetches);
    return concat("cost of extra layers: ", cost.layers, cost.layers == 1 ? " layer" : " layers",
                  cost.ids > 0 ? concat(" with ", cost.ids, " ids") : std::string(), ", ",
                  cost.runs, cost.runs == 1 ? " run, " : " runs, ", cost.dispatches,
                  " dispatches, ", bytes_text(cost.peak_bytes), " of textures, at most ", fetches,
                  " times the fetches of color alone\n");
}

}  // namespace postchain::sequence
