#include "chain/pass.h"

#include "chain/work_list.h"

namespace postchain {

const PassType* PassRegistry::find(std::string_view name) const {
    for (const auto& type : types_)
        if (type.name == name) return &type;
    return nullptr;
}

std::vector<ElisionRule> elision_rules(const PassRegistry& registry) {
    std::vector<ElisionRule> rules = chain_rules();
    for (const auto& type : registry.types())
        rules.insert(rules.end(), type.rules.begin(), type.rules.end());
    return rules;
}

LeftOut left_out_of_blocks(const std::string& what, const std::string& rule,
                           const std::string& reason, TextureId list, int taps_px, bool outside) {
    LeftOut left{what, rule, reason, 0, 0, 0};
    left.work_list = list;
    left.outside = outside;
    left.taps_per_block = uint64_t(kBlockPx) * kBlockPx * uint64_t(taps_px);
    return left;
}

}  // namespace postchain
