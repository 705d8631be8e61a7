// A chain for frames at a smaller size.
#pragma once

#include "chain/pass/chain.h"

namespace postchain::sequence {

// Scales the passes' lengths in pixels, unless the result is out of the row's range.
void reduce_lengths(Chain& chain, double scale);

}  // namespace postchain::sequence
