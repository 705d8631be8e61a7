// Chains by name for hosts without a reader of chain files: "tier:fast".
#pragma once

#include <string_view>
#include <vector>

#include "chain/chain.h"
#include "chain/status.h"

namespace postchain::guest {

struct Tier {
    const char* name;
    const char* help;
    struct Pass {
        const char* type;
        std::vector<std::pair<const char*, ParameterValue>> values = {};
    };
    std::vector<Pass> passes;
};

const std::vector<Tier>& tiers();
// Errors (chain): unknown name; the message lists the names.
Result<Chain> make_tier(std::string_view name, const PassRegistry& registry);

}  // namespace postchain::guest
