// Overrides: the arguments of --set, applied to a parsed chain.
#pragma once

#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "config/diagnostic.h"

namespace postchain {

// One index into Chain::links per entry of a file's list `passes`, or -1 for a faulty entry.
using PassEntries = std::vector<int>;

// Applies `overrides` to `chain`: camera first, then passes, each in the given order. Errors go to
// `diagnostics` (StatusCode::usage).
void apply_overrides(const std::vector<std::string>& overrides, const PassEntries& entries,
                     const PassRegistry& registry, Chain& chain, Diagnostics& diagnostics);

}  // namespace postchain
