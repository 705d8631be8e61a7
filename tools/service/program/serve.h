#pragma once

#include "tools/apps/common/program.h"

namespace postchain {

RunSubcommand add_serve(CLI::App& subcommand, Options& options);

}  // namespace postchain
