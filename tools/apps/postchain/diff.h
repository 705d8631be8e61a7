// postchain diff: error metrics of B against the reference A, one image or a sequence.
//
//   file --profile--> color role --> Pair --tools/metrics--> values, error map
//
// HDR-FLIP's exposures come from the references alone; those of a sequence are read once before,
// so that every frame is judged at the same exposures.
#pragma once

#include "tools/apps/postchain/diff_work.h"

namespace postchain {

void add_diff(CLI::App& verb, Options& options, DiffOptions& diff);
int diff_verb(const Options& options, const DiffOptions& diff);

}  // namespace postchain
