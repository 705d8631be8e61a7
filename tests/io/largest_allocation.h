// The largest piece of memory that operator new was asked for, in this process and by every
// library in it: what a header made its reader allocate, whether or not the pages were touched.
#pragma once

#include <cstddef>

namespace postchain::test {

// Starts again; bytes of the largest request since then. All threads count.
void forget_allocations();
size_t largest_allocation();

}  // namespace postchain::test
