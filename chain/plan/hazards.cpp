#include "chain/plan/hazards.h"

#include <algorithm>
#include <numeric>

namespace postchain {
namespace {

// The last steps that wrote and read one storage; -1 = none.
struct Use {
    TextureId texture = -1;  // texture that was written
    int written = -1;
    int read = -1;
};

class Waits {
  public:
    explicit Waits(size_t steps) : waits_(steps, 0) {}

    // Puts a barrier for this use between step `from` and step `to`. An existing one there serves
    // too, whatever it was for.
    void need(uint32_t wait, int from, int to) {
        if (from < 0) return;
        uint32_t between = 0;
        for (int i = from + 1; i <= to; ++i) between |= waits_[size_t(i)];
        if (between & wait) return;
        if (last_ <= from) last_ = to;
        waits_[size_t(last_)] |= wait;
    }
    std::vector<uint32_t> take() { return std::move(waits_); }

  private:
    std::vector<uint32_t> waits_;
    int last_ = -1;  // step with the last barrier
};

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

std::vector<uint32_t> waits_of(const Plan& plan, const std::vector<int>& storage) {
    int count = 0;
    for (const int number : storage) count = std::max(count, number + 1);
    std::vector<Use> uses(static_cast<size_t>(count));
    const auto use_of = [&](TextureId texture) -> Use& {
        return uses[size_t(storage[size_t(texture)])];
    };
    Waits waits(plan.steps.size());
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        const Step& step = plan.steps[size_t(i)];
        for (const auto& binding : step.bindings) {
            const Use& use = use_of(binding.texture);
            if (binding.access == Access::list) {
                waits.need(kWaitList, use.written, i);
            } else if (binding.access == Access::write) {
                if (use.texture != binding.texture) waits.need(kWaitImage, use.written, i);
                waits.need(kWaitImage, use.read, i);
            } else if (binding.access == Access::read) {
                waits.need(kWaitImage, use.written, i);
            } else {
                waits.need(kWaitFetch, use.written, i);
            }
        }
        if (step.work_list >= 0) waits.need(kWaitLaunch, use_of(step.work_list).written, i);
        for (const auto& binding : step.bindings) {
            Use& use = use_of(binding.texture);
            if (step.writes(binding)) {
                use.texture = binding.texture;
                use.written = i;
            } else if (binding.access != Access::list) {
                use.read = i;
            }
        }
    }
    return waits.take();
}

uint32_t uses_of(const Step& step, const Binding& binding) {
    switch (binding.access) {
        case Access::sample_nearest:
            return kUseFetch;
        case Access::read:
            return kUseImageRead;
        case Access::write:
            return kUseImageWrite;
        case Access::list:
            break;
    }
    return binding.texture == step.work_list ? kUseListRead | kUseLaunch : uint32_t(kUseListWrite);
}

std::vector<Transition> transitions_of(const Plan& plan, const std::vector<int>& storage,
                                       const std::vector<uint32_t>& waits) {
    int count = 0;
    for (const int number : storage) count = std::max(count, number + 1);
    std::vector<Transition> last(static_cast<size_t>(count));  // of each storage
    std::vector<Transition> all;
    std::vector<size_t> used;  // storages of the steps since the last wait
    const auto end_level = [&] {
        for (const size_t place : used) {
            Transition& now = last[place];
            if (now.from != now.to || (now.to & kUseWrites) != 0) all.push_back(now);
            now.from = now.to;
            now.to = 0;
            now.before = now.texture;
        }
        used.clear();
    };
    int first = 0;  // step of the level
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        if (waits[size_t(i)] != 0) {
            end_level();
            first = i;
        }
        const Step& step = plan.steps[size_t(i)];
        for (const Binding& binding : step.bindings) {
            const auto place = size_t(storage[size_t(binding.texture)]);
            Transition& now = last[place];
            if (now.to == 0) used.push_back(place);
            now.step = first;
            now.texture = binding.texture;
            now.to |= uses_of(step, binding);
        }
    }
    end_level();
    std::ranges::stable_sort(all, {}, &Transition::step);
    return all;
}

bool share_imports(const Plan& plan, const std::vector<unsigned>& names,
                   std::vector<int>& storage) {
    const size_t count = plan.textures.size();
    bool changed = false;
    for (size_t t = 0; t < count; ++t) {
        if (!plan.textures[t].imported) continue;
        size_t first = 0;
        while (!plan.textures[first].imported || names[first] != names[t]) ++first;
        const int shared = int(count + (names[t] == 0 ? t : first));
        changed = changed || shared != storage[t];
        storage[t] = shared;
    }
    return changed;
}

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
