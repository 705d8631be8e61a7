// postchain plan, info, schema, passes: print plans, the device, and parameters.
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

// `pilot`: path of a sidecar, empty = none.
int plan_verb(const Options& options, const std::string& format, const std::string& pilot);
int info_verb(const Options& options);
int schema_verb();
int passes_verb(const std::string& format);

}  // namespace postchain
