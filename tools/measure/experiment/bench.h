// postchain bench: error against run time over the product of sweeps.
//
//   chain x sweeps      --sweep.h--> variants
//   each frame, variant --GPU--> metrics against the truth, pictures; on some frames flicker and
//                                grid (temporal_stability.h), the error in three parts (converge.h)
//                                                              --> DIR/results/*.json
//   each variant alone  --timing.h--> time of each pass        --> DIR/results/*.json
//   all results         --choose.h-->  means, Pareto set, the cheapest under a limit
//
// A result is kept under the hash of the chain and used again when its key (chain, input and truth
// files, device, settings) is the same: a bench that was killed goes on where it was.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/sweep.h"

namespace postchain::experiment {

// `files`: of prepare_folder(), in whose folder it writes. A variant that fails keeps its message
// and the others go on. Errors: those of input and truth, (output), (canceled) by `stop`.
Result<report::Report> run_bench(const std::vector<BenchVariant>& variants,
                                 const BenchSettings& settings, const io::OutputFiles& files,
                                 Executor& executor, const ProgressCallback& progress,
                                 const std::atomic<bool>* stop);

}  // namespace postchain::experiment
