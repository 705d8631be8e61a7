#include "chain/levels.h"

#include <algorithm>
#include <numeric>

namespace postchain {
namespace {

// The number of levels that a step has to follow an earlier one by; -1: any order will do.
int distance_between(const Step& earlier, const Step& later) {
    int distance = -1;
    for (const Binding& a : earlier.bindings)
        for (const Binding& b : later.bindings) {
            if (a.texture != b.texture) continue;
            const bool first = earlier.writes(a), second = later.writes(b);
            if (first || second) distance = std::max(distance, first && second ? 0 : 1);
        }
    return distance;
}

}  // namespace

std::vector<int> levels_of(const Plan& plan) {
    const size_t count = plan.steps.size();
    // From the last step to the first: the number of levels after each.
    std::vector<int> after(count, 0);
    for (size_t i = count; i-- > 0;)
        for (size_t later = i + 1; later < count; ++later)
            if (const int distance = distance_between(plan.steps[i], plan.steps[later]);
                distance >= 0)
                after[i] = std::max(after[i], after[later] + distance);
    const int last = count == 0 ? 0 : *std::max_element(after.begin(), after.end());
    for (int& level : after) level = last - level;
    return after;
}

void order_by_level(Plan& plan) {
    const std::vector<int> levels = levels_of(plan);
    std::vector<size_t> order(plan.steps.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return levels[a] < levels[b]; });
    std::vector<Step> steps;
    for (const size_t i : order) steps.push_back(std::move(plan.steps[i]));
    plan.steps = std::move(steps);
    std::vector<TextureId> outputs;
    for (const auto& [role, id] : plan.outputs) outputs.push_back(id);
    find_lifetimes(plan, outputs);
}

}  // namespace postchain
