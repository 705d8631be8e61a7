// Half floats, rounded to the nearest, ties to even.
#pragma once

#include <cstddef>
#include <cstdint>

namespace postchain::gl {

void to_halves(const float* from, uint16_t* to, size_t count);
void from_halves(const uint16_t* from, float* to, size_t count);

}  // namespace postchain::gl
