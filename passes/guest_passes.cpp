#include "passes/guest_passes.h"

#include "passes/registry.h"

namespace postchain::guest {

const PassRegistry& passes() {
    return builtin_passes();
}

}  // namespace postchain::guest
