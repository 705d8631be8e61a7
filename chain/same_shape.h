// Which plans a compiled one can take the values of.
#pragma once

#include "chain/plan.h"

namespace postchain {

// True if both plans differ only in values and in what fit() sets. Names of passes and elisions do
// not count.
bool same_shape(const Plan& a, const Plan& b);

}  // namespace postchain
