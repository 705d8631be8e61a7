// The checks color, motion and depth: a small change of the input changes the result little.
#pragma once

#include "tools/stress/measurement.h"

namespace postchain::stress {

Status check_continuity(Measurement& measured);

}  // namespace postchain::stress
