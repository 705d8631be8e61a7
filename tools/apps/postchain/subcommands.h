// The subcommands of this program. Each add_NAME() is one for Subcommand::add.
#pragma once

#include "tools/apps/common/program.h"

namespace postchain {

RunSubcommand add_check(CLI::App& subcommand, Options& options);
RunSubcommand add_diff(CLI::App& subcommand, Options& options);
RunSubcommand add_info(CLI::App& subcommand, Options& options);  // describe.cpp
RunSubcommand add_inspect(CLI::App& subcommand, Options& options);
RunSubcommand add_passes(CLI::App& subcommand, Options& options);  // describe.cpp
RunSubcommand add_plan(CLI::App& subcommand, Options& options);
RunSubcommand add_run(CLI::App& subcommand, Options& options);
RunSubcommand add_schema(CLI::App& subcommand, Options& options);  // describe.cpp
RunSubcommand add_selftest(CLI::App& subcommand, Options& options);
RunSubcommand add_sheet(CLI::App& subcommand, Options& options);

}  // namespace postchain
