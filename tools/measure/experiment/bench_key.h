// What the results of a bench follow from, as text: those of equal text are the same.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/experiment/basis.h"
#include "tools/measure/experiment/sweep.h"

namespace postchain::experiment {

// Everything a result depends on except chain and input files.
std::string conditions_of(const report::Report& report, const BenchSettings& settings,
                          const std::vector<BenchVariant>& variants);

// The chain, the files of input and truth of this frame and, where a step in time is measured, of
// the one before; `more`: what else. Errors (input): files that cannot be read.
Result<std::string> work_on(const Chain& chain, int frame, const std::string& more,
                            const BenchSettings& settings, const Basis& basis);

}  // namespace postchain::experiment
