// postchain ab: two chains over the same frames, and what the difference is worth.
//
//   each frame: plan A, plan B --merge--> filter both --> metrics against the truth, images
//   afterwards: times of each chain alone; intervals over frames and tiles; verdict
#pragma once

#include "tools/measure/experiment/experiment.h"

namespace postchain::experiment {

struct NamedChain {
    std::string name;  // "paper"
    Chain chain;
};

// Runs both chains and returns the report, images written; the report's own files are not. A chain
// that fails on a frame leaves a message in its variant, and the other goes on. Without a truth
// the second is measured against the first. Errors: (usage), (input) as of the truth, the folder
// (output), (canceled) by `stop`, (gl).
Result<report::Report> run_ab(const NamedChain& a, const NamedChain& b,
                              const ExperimentSettings& settings, Executor& executor,
                              const ProgressCallback& progress, const std::atomic<bool>* stop);

}  // namespace postchain::experiment
