// Number of calls of operator new in this program, which replaces it by a counting one.
#pragma once

#include <cstdint>

namespace postchain::test {

uint64_t allocations();
// Makes every operator new of this thread fail until the next call with false.
void refuse_memory(bool refuse);

}  // namespace postchain::test
