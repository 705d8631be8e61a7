// A pass that reads the frames before and after: it adds a quarter of the difference to each. A
// frame that is not there is black. Kept to show that
// planes of neighbors reach a pass from files and from an engine, and which of them are there.
#pragma once

#include "chain/pass/pass.h"

namespace postchain::echo {

// Reads and writes color; can use every plane of both neighbors.
const PassType& pass_type();

}  // namespace postchain::echo
