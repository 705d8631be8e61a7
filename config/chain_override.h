// Overrides: the texts of --set, applied to a chain that has been read.
#pragma once

#include <string>
#include <vector>

#include "chain/chain.h"
#include "config/diagnostic.h"

namespace postchain {

// Entries of a file's list `passes`, in order: the index in Chain::links, or -1 for an entry that
// could not be read.
using PassEntries = std::vector<int>;

// Applies `overrides` to `chain` (camera first, then passes, each in the order given) and reports
// into `diagnostics`, StatusCode::usage.
void apply_overrides(const std::vector<std::string>& overrides, const PassEntries& entries,
                     const PassRegistry& registry, Chain& chain, Diagnostics& diagnostics);

}  // namespace postchain
