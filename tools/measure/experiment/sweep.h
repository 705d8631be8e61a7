// Sweeps: texts -> product of variants.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "chain/pass.h"
#include "config/chain_find.h"

namespace postchain::experiment {

inline constexpr int kMaxVariants = 64;

struct Sweep {
    std::string key;  // "motion_blur.samples"
    std::vector<std::string> values;
};
// "KEY=V1,V2,..."; errors (usage): another form, an empty value.
Result<Sweep> parse_sweep(const std::string& text);

struct BenchVariant {
    std::string name;  // "motion_blur.samples=5 fxaa.preset=10"
    std::vector<std::pair<std::string, std::string>> sweep;
    Chain chain;
};
// The product, the last sweep changing fastest; variants that are the same chain stand once. Keys
// and values are those of --set and give its errors (usage): an unknown key names the nearest.
// Without sweeps: the chain itself. Also (usage): more than `max_variants`; two sweeps of one
// value, however its key is written.
Result<std::vector<BenchVariant>> sweep_variants(const ChainText& chain,
                                                 const PassRegistry& registry,
                                                 const std::vector<std::string>& sets,
                                                 const std::vector<Sweep>& sweeps,
                                                 int max_variants);

}  // namespace postchain::experiment
