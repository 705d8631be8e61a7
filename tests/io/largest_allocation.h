// The largest allocation with operator new in this process, libraries included, whether or not its
// pages were touched.
#pragma once

#include <cstddef>

namespace postchain::test {

// Resets the maximum; and the bytes of the largest request since, of all threads.
void forget_allocations();
size_t largest_allocation();

}  // namespace postchain::test
