#include "tools/apps/view/result_store.h"

#include <algorithm>

namespace postchain::view {

const Shown* ResultStore::find(const ResultKey& key) {
    const auto found = kept_.find(key);
    if (found == kept_.end()) return nullptr;
    found->second.used = ++clock_;
    return &found->second.shown;
}

void ResultStore::keep(const ResultKey& key, Shown shown) {
    const uint64_t size = shown.color->data.size() * sizeof(float);
    if (size > budget_) return;
    shown.texture = nullptr;
    shown.texture_name.clear();
    std::erase_if(kept_, [&](const auto& entry) {
        const ResultKey& other = entry.first;
        return other.frame == key.frame &&
               (other.version != key.version || other.shaders != key.shaders);
    });
    kept_[key] = {std::move(shown), size, ++clock_};
    while (bytes() > budget_)
        kept_.erase(std::min_element(kept_.begin(), kept_.end(), [](const auto& a, const auto& b) {
            return a.second.used < b.second.used;
        }));
}

std::vector<ResultKey> ResultStore::keys() const {
    std::vector<ResultKey> keys;
    for (const auto& [key, kept] : kept_) keys.push_back(key);
    return keys;
}

uint64_t ResultStore::bytes() const {
    uint64_t bytes = 0;
    for (const auto& [key, kept] : kept_) bytes += kept.bytes;
    return bytes;
}

}  // namespace postchain::view
