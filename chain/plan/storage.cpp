#include "chain/plan/storage.h"

#include <algorithm>
#include <numeric>

#include "chain/plan/hazards.h"

namespace postchain {
namespace {

Storage storage_for(const Plan& plan, const PlanTexture& texture,
                    const std::optional<MaxFrameSize>& max_size) {
    Storage storage = texture;
    if (!max_size) return storage;
    const int tile_px = texture.pass < 0 ? 1 : plan.passes[size_t(texture.pass)].tiles.least_px;
    const auto size = size_of(texture, {max_size->width, max_size->height, tile_px});
    storage.width = size[0];
    storage.height = size[1];
    return storage;
}

}  // namespace

uint64_t StoragePlan::bytes() const {
    uint64_t sum = 0;
    for (const Storage& storage : all) sum += storage.bytes();
    return sum;
}

std::vector<int> StoragePlan::numbers() const {
    std::vector<int> numbers(of);
    for (size_t t = 0; t < of.size(); ++t)
        if (of[t] < 0) numbers[t] = int(of.size() + t);
    return numbers;
}

StoragePlan share_storage(const Plan& plan, const std::optional<MaxFrameSize>& max_size) {
    const size_t count = plan.textures.size();
    std::vector<int> own(count);
    std::iota(own.begin(), own.end(), 0);
    const std::vector<uint32_t> waits = waits_of(plan, own);
    StoragePlan shared;
    shared.of.assign(count, -1);
    std::vector<char> in_use;  // of each storage
    int released = 0;          // textures whose last step is before this one
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        for (size_t t = 0; t < count && waits[size_t(i)]; ++t) {
            const PlanTexture& texture = plan.textures[t];
            if (shared.of[t] >= 0 && texture.last_step >= released && texture.last_step < i &&
                texture.format != Format::work_list)  // small; filter() counts it
                in_use[size_t(shared.of[t])] = 0;
        }
        if (waits[size_t(i)]) released = i;
        for (size_t t = 0; t < count; ++t) {
            const PlanTexture& texture = plan.textures[t];
            if (texture.imported || texture.first_step != i) continue;
            const Storage needed = storage_for(plan, texture, max_size);
            size_t place = 0;
            while (place < in_use.size() && (in_use[place] || shared.all[place] != needed)) ++place;
            if (place == in_use.size()) {
                shared.all.push_back(needed);
                in_use.push_back(0);
            }
            in_use[place] = 1;
            shared.of[t] = int(place);
        }
    }
    return shared;
}

}  // namespace postchain
