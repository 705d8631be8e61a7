// All passes of this build. The list is made from passes/CMakeLists.txt.
#pragma once

#include "chain/pass/pass.h"

namespace postchain {

const PassRegistry& builtin_passes();

}  // namespace postchain
