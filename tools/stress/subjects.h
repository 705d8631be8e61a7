#pragma once

#include <vector>

#include "tools/stress/matrix.h"

namespace postchain::stress {

// Each pass of the registry by itself, and shipped chains of both orders. Errors (chain).
Result<std::vector<Subject>> every_subject(const PassRegistry& passes);

}  // namespace postchain::stress
