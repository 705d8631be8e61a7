// Every pass this build has. The list is made from passes/CMakeLists.txt.
#pragma once

#include "chain/pass.h"

namespace postchain {

const PassRegistry& builtin_passes();

}  // namespace postchain
