// postchain run: the runner with messages, progress and signals around it.
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

int run_verb(const Options& options);

}  // namespace postchain
