// postchain bench: error against run time over the product of sweeps.
//
//   chain x sweeps      --sweep.h--> variants
//   each frame, variant --GPU--> metrics against the ground truth, images; on some frames flicker
//                                and grid (temporal_stability.h), the error in three parts
//                                (converge.h)                  --> DIR/results/*.json
//   each variant        --timing.h--> time of each pass        --> DIR/results/*.json
//   all results         --choose.h-->  means, Pareto set, the cheapest under a limit
//
// Results are stored under the hash of the chain and reused if their key (chain, input and ground
// truth files, device, settings) is equal, so that an interrupted bench continues.
#pragma once

#include <atomic>
#include <vector>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/sweep.h"

namespace postchain::experiment {

// `files`: from prepare_folder(); the report is written there. If a variant fails, it gets a
// message and the others continue. Errors: those of input and ground truth, (output), (canceled) by
// `stop`.
Result<report::Report> run_bench(const std::vector<BenchVariant>& variants,
                                 const BenchSettings& settings, const io::OutputFiles& files,
                                 Executor& executor, const ProgressCallback& progress,
                                 const std::atomic<bool>* stop);

}  // namespace postchain::experiment
