// postchain run: the runner with messages, progress and signals.
#pragma once

#include <optional>

#include "tools/apps/postchain/options.h"
#include "tools/sequence/record/record.h"

namespace postchain {

void add_run(CLI::App& subcommand, Options& options);
// `like`: the record to repeat (like.h), if any.
int run_subcommand(const Options& options, const std::optional<sequence::Record>& like);

}  // namespace postchain
