// Checks that are known to miss their bound: each pass names its own (PassType::known_limits), with
// the bound that is kept instead and why. docs/stability.md says more of each.
#pragma once

#include "tools/measure/stress/matrix.h"

namespace postchain::stress {

// Turns a failed check of this chain into a limit where it is a known one and inside its bound. Of
// each pass the first limit that names check, parameters and cell counts; of several passes, the
// widest.
void apply_known_limits(const Chain& chain, CellResult& cell);

}  // namespace postchain::stress
