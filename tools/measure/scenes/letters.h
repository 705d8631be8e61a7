// Font for signs, 5x7 dots.
#pragma once

#include <array>
#include <cstdint>

namespace postchain::scenes {

inline constexpr int kLetterColumns = 6;  // the last one is the gap

// Columns from left to right, lowest bit at the top. Unknown letters are blank.
std::array<uint8_t, kLetterColumns> columns_of(char letter);

}  // namespace postchain::scenes
