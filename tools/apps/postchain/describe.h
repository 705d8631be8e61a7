// postchain plan, info, schema, passes: print plans, the device, and parameters.
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

// `calibration`: path of a sidecar, empty = none.
int plan_subcommand(const Options& options, const std::string& format,
                    const std::string& calibration);
int info_subcommand(const Options& options);
int schema_subcommand();
int passes_subcommand(const std::string& format);

}  // namespace postchain
