#include "chain/hazards.h"

#include <algorithm>

namespace postchain {
namespace {

constexpr uint32_t kAll = kWaitFetch | kWaitImage | kWaitList | kWaitLaunch;

// Of one storage, since the last barriers.
struct Use {
    TextureId writer = -1;  // who wrote it last
    uint32_t unseen = 0;    // for which kinds of use the write is not yet visible
    bool read = false;      // a step that may still run reads it
};

}  // namespace

std::vector<uint32_t> waits_of(const Plan& plan, const std::vector<int>& storage) {
    int count = 0;
    for (const int number : storage) count = std::max(count, number + 1);
    std::vector<Use> uses(static_cast<size_t>(count));
    const auto use_of = [&](TextureId texture) -> Use& {
        return uses[size_t(storage[size_t(texture)])];
    };
    std::vector<uint32_t> waits;
    for (const Step& step : plan.steps) {
        uint32_t needed = 0;
        for (const auto& binding : step.bindings) {
            const Use& use = use_of(binding.texture);
            if (binding.access == Access::list) {
                needed |= use.unseen & kWaitList;
            } else if (binding.access == Access::write) {
                if (use.writer != binding.texture) needed |= use.unseen & kWaitImage;
                if (use.read) needed |= kWaitImage;
            } else {
                needed |= use.unseen & kWaitFetch;
            }
        }
        if (step.work_list >= 0) needed |= use_of(step.work_list).unseen & kWaitLaunch;
        for (Use& use : uses) {
            use.unseen &= ~needed;
            if (needed & kWaitImage) use.read = false;
        }
        for (const auto& binding : step.bindings) {
            Use& use = use_of(binding.texture);
            if (step.writes(binding)) {
                use.writer = binding.texture;
                use.unseen = kAll;
            } else if (binding.access != Access::list) {
                use.read = true;
            }
        }
        waits.push_back(needed);
    }
    return waits;
}

}  // namespace postchain
