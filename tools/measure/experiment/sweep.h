// The chains of an experiment: given by name, or the product of sweeps.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "chain/pass/pass.h"
#include "config/chain_find.h"

namespace postchain::experiment {

inline constexpr int kMaxVariants = 64;

struct Sweep {
    std::string key;  // "motion_blur.samples"
    std::vector<std::string> values;
};
// Parses "KEY=V1,V2,...". Errors (usage): another form, an empty value.
Result<Sweep> parse_sweep(const std::string& text);

struct NamedChain {
    std::string name;  // "paper", "motion_blur.samples=5 fxaa.preset=10"
    Chain chain;
    std::vector<std::pair<std::string, std::string>> sweep;  // key, value
};
// The product of the sweeps, the last one changing fastest; equal chains appear once. Without
// sweeps: the chain itself. Errors (usage): those of --set for keys and values (an unknown key
// suggests the closest); more than `max_variants` variants; two sweeps of one value, even under
// different keys.
Result<std::vector<NamedChain>> sweep_variants(const ChainText& chain, const PassRegistry& registry,
                                               const std::vector<std::string>& sets,
                                               const std::vector<Sweep>& sweeps, int max_variants);

}  // namespace postchain::experiment
