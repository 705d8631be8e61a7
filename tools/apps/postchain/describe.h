// postchain info, schema, passes: print the device, and parameters.
#pragma once

#include <string>

#include "tools/apps/postchain/options.h"

namespace postchain {

void add_info(CLI::App& subcommand, Options& options);
int info_subcommand(const Options& options);
int schema_subcommand();
// `format`: "text", "json" or "markdown".
void add_passes(CLI::App& subcommand, std::string& format);
int passes_subcommand(const std::string& format);

}  // namespace postchain
