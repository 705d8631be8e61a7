// The byte transforms of ZIP and ZIPS before deflate: the low bytes of all 16-bit words, then their
// high bytes; then each byte minus the one before it.
//
// Source: "OpenEXR File Layout" and ImfZip.cpp of OpenEXR 3.1.
#pragma once

#include <cstddef>
#include <cstdint>

namespace postchain::io {

// Splits `words` little-endian words into their low and high bytes, and back.
void split_words(const uint8_t* from, size_t words, uint8_t* low, uint8_t* high);
void join_words(const uint8_t* low, const uint8_t* high, size_t words, uint8_t* to);

// In place: b[i] = b[i] - b[i - 1] + 128 modulo 256; b[0] stays. And back.
void to_differences(uint8_t* bytes, size_t count);
void from_differences(uint8_t* bytes, size_t count);

}  // namespace postchain::io
