// How often this program has called operator new, which is replaced by one that counts.
#pragma once

#include <cstdint>

namespace postchain::test {

uint64_t allocations();
// From now on every operator new of this thread fails, until it is called with false.
void refuse_memory(bool refuse);

}  // namespace postchain::test
