// Passes that no program ships (tests/passes/CMakeLists.txt).
#pragma once

#include "chain/pass/pass.h"

namespace postchain {

const PassRegistry& fixture_passes();

}  // namespace postchain
