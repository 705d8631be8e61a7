#include "chain/guest/tiers.h"

#include <string>

namespace postchain::guest {

// Those that have the name of a shipped chain are that chain, but for `neighbors`: a host has one
// frame at a time. Errors: docs/integration.md.
const std::vector<Tier>& tiers() {
    using std::string;
    static const std::vector<Tier> all = {
        {"realtime",
         "motion blur and depth of field in one with 8 samples, for games",
         {{"joint_blur", {{"samples", int64_t(8)}, {"neighbors", string("none")}}},
          {"fxaa", {{"mode", string("directional")}}}}},
        {"fast",
         "16 samples",
         {{"joint_blur", {{"samples", int64_t(16)}, {"neighbors", string("none")}}},
          {"fxaa", {{"mode", string("directional")}}}}},
        {"balanced",
         "32 samples",
         {{"joint_blur", {{"samples", int64_t(32)}, {"neighbors", string("none")}}},
          {"fxaa", {{"mode", string("directional")}}}}},
        {"best",
         "128 samples, for stills and film",
         {{"joint_blur",
           {{"samples", int64_t(128)}, {"starts", int64_t(8)}, {"neighbors", string("none")}}}}}};
    return all;
}

Result<Chain> make_tier(std::string_view name, const PassRegistry& registry) {
    std::string names;
    for (const Tier& tier : tiers()) {
        names += (names.empty() ? "" : ", ") + std::string(tier.name);
        if (tier.name != name) continue;
        Chain chain;
        for (const Tier::Pass& pass : tier.passes) {
            Pass* made = chain.append(registry, pass.type);
            if (!made)
                return Status(StatusCode::chain,
                              concat("tier:", name, ": this library has no pass ", pass.type));
            const ParameterTable& table = *chain.links.back().type->parameters;
            for (const auto& [key, value] : pass.values)
                if (Status s = table.set(made->parameters(), key, value); !s.ok())
                    return s.at(pass.type);
        }
        return chain;
    }
    return Status(StatusCode::chain, concat("unknown tier \"", name, "\"; known are ", names));
}

}  // namespace postchain::guest
