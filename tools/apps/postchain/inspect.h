// postchain inspect: what a file holds, how it was understood, and whether its vectors point the
// way the profile says.
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

int inspect_verb(const Options& options);

}  // namespace postchain
