// Runs chains over the frames of a sequence and measures them: ab, bench, and the tasks of a study.
//
//   each frame, chain --GPU--> metrics against the reference, images; on some frames flicker and
//                              grid (temporal_stability.h), the error in three parts (converge.h)
//   each chain        --timing.h--> time of each pass
//   all results       --outcome.h--> means, verdict or Pareto set
//
// The reference is the ground truth. Without it ab measures B against A, and bench each chain
// against its own filter converged. bench stores its results under the hash of the chain
// (result_store.h) and reuses them, so that an interrupted bench continues.
#pragma once

#include <atomic>
#include <vector>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/sweep.h"

namespace postchain::experiment {

// Both return the report and write its images, but not its own files. If a chain fails on a frame,
// its variant gets a message and the others continue. Errors: those of input and ground truth, the
// folder (output), (canceled) by `stop`.

// `settings.folder` is prepared once the input has been found to be usable.
Result<report::Report> run_ab(const NamedChain& a, const NamedChain& b,
                              const ExperimentSettings& settings, Executor& executor,
                              const ProgressCallback& progress, const std::atomic<bool>* stop);

// `files`: from prepare_folder().
Result<report::Report> run_bench(const std::vector<NamedChain>& variants,
                                 const BenchSettings& settings, const io::OutputFiles& files,
                                 Executor& executor, const ProgressCallback& progress,
                                 const std::atomic<bool>* stop);

}  // namespace postchain::experiment
