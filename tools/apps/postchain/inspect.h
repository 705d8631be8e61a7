// postchain inspect: what a file contains, how it is interpreted, and whether its motion vectors
// have the profile's signs.
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

void add_inspect(CLI::App& subcommand, Options& options);
int inspect_subcommand(const Options& options);

}  // namespace postchain
