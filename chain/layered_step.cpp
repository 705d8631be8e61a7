#include "chain/layered_step.h"

#include <algorithm>

namespace postchain {

void add_layered_step(PassPlanner& planner, Step step, const std::vector<Binding>& arrays,
                      uint64_t taps) {
    const int layers = planner.has(Role::layers) ? planner.context().frame.layers : 0;
    if (layers == 0) {
        planner.step(std::move(step));
        return;
    }
    const FrameDescription& frame = planner.context().frame;
    const auto groups = step.spread.of({frame.width, frame.height});
    for (int first = 0; first < layers; first += kLayersPerStep) {
        Step one = step;
        one.layers = std::min(layers, kLayersPerStep);
        one.first_layer = std::min(first, layers - one.layers);
        one.taps += taps * uint64_t(one.layers);
        if (one.group_taps > 0)
            one.group_taps +=
                taps * uint64_t(one.layers) / (uint64_t(groups[0]) * uint64_t(groups[1]));
        one.program.defines["LAYERS"] = std::to_string(one.layers);
        if (first > 0) {
            one.name += concat("_layers_", first);
            one.program.defines["LAYERS_ONLY"] = "1";
            std::erase_if(one.bindings, [](const Binding& b) { return b.access == Access::write; });
        }
        one.bindings.insert(one.bindings.end(), arrays.begin(), arrays.end());
        planner.step(std::move(one));
    }
}

}  // namespace postchain
