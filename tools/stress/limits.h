// Checks that a pass is known to miss, with the bound that it keeps instead and the reason.
// docs/stability.md describes each.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/pass/chain.h"

namespace postchain::stress {

struct CellResult;

struct KnownLimit {
    std::string check;       // "mirror"
    std::string parameters;  // pattern of the pass's parameters: "leak=coc"; empty = any
    std::string cells;       // pattern of CellResult::name(): "/speed/*1 px"
    double bound = 0;        // a value beyond it fails nevertheless
    std::string reason;
};

// By the name of the pass; of a pass, the special ones stand first. A pass without an entry has
// none.
using KnownLimits = std::map<std::string, std::vector<KnownLimit>>;

// The limits of the shipped passes.
const KnownLimits& known_limits();

// Turns a failed check of this chain into a limit if it is a known one and inside its bound. The
// first limit of a pass that names check, parameters and cell counts; of several passes, the
// widest.
void apply_known_limits(const Chain& chain, CellResult& cell,
                        const KnownLimits& limits = known_limits());

}  // namespace postchain::stress
