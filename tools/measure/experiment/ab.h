// postchain ab: runs two chains over the same frames and tests their difference.
//
//   each frame: filtered by A and by B --> metrics against the ground truth, images
//   afterwards: times of each chain; intervals over frames and tiles; verdict
#pragma once

#include <atomic>

#include "tools/measure/experiment/experiment.h"

namespace postchain::experiment {

struct NamedChain {
    std::string name;  // "paper"
    Chain chain;
};

// Runs both chains and returns the report. Writes its images but not the report's own files. If a
// chain fails on a frame, its variant gets a message and the other chain continues. Without a
// ground truth, B is measured against A. Errors: (usage), (input) of the ground truth, the folder
// (output), (canceled) by `stop`, (gl).
Result<report::Report> run_ab(const NamedChain& a, const NamedChain& b,
                              const ExperimentSettings& settings, Executor& executor,
                              const ProgressCallback& progress, const std::atomic<bool>* stop);

}  // namespace postchain::experiment
