// The passes of the guest. chain/ knows no pass; the library of passes defines this function.
#pragma once

#include "chain/pass.h"

namespace postchain::guest {

const PassRegistry& passes();

}  // namespace postchain::guest
