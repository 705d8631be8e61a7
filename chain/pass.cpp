#include "chain/pass.h"

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

}  // namespace postchain
