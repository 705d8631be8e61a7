// Makes of a SPIR-V module what a driver may: a product that feeds a sum becomes one operation with
// it, rounded once, unless either is NoContraction. Likewise the sums of products in dot(), mix()
// and so on, if those are not.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace postchain::test {

std::vector<uint32_t> contracted(std::span<const uint32_t> module);

}  // namespace postchain::test
