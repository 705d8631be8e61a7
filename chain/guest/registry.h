// The passes that a guest has: chain/ knows none, the library of passes that is linked beside it
// defines this function.
#pragma once

#include "chain/pass.h"

namespace postchain::guest {

const PassRegistry& passes();

}  // namespace postchain::guest
