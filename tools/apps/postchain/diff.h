// postchain diff: error metrics of B against the reference A, for one image or a sequence.
//
//   file --profile--> color role --> Pair --tools/metrics--> values, error map
//
// HDR-FLIP's exposures come from the references only. For a sequence all references are read first,
// so that every frame is measured at the same exposures.
#pragma once

#include "tools/apps/postchain/diff_work.h"

namespace postchain {

void add_diff(CLI::App& subcommand, Options& options, DiffOptions& diff);
int diff_subcommand(const Options& options, const DiffOptions& diff);

}  // namespace postchain
