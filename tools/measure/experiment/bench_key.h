// Keys of bench results: equal keys mean equal results.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/experiment/basis.h"
#include "tools/measure/experiment/sweep.h"

namespace postchain::experiment {

// Everything a result depends on except chain and input files.
std::string conditions_of(const report::Report& report, const BenchSettings& settings,
                          const std::vector<BenchVariant>& variants);

// Key part for the chain and this frame's input and ground truth files, with the previous frame's
// if a difference over time is measured. `more`: further conditions. Errors (input): files that
// cannot be read.
Result<std::string> work_on(const Chain& chain, int frame, const std::string& more,
                            const BenchSettings& settings, const Basis& basis);

}  // namespace postchain::experiment
