// What ZIP and ZIPS of EXR do to the bytes of a chunk before they are deflated: the low bytes of
// all 16-bit words, then their high bytes; then each byte as its difference from the one before.
//
// Source: "OpenEXR File Layout" and ImfZip.cpp of OpenEXR 3.1.
#pragma once

#include <cstddef>
#include <cstdint>

namespace postchain::io {

// `words` little-endian words, as their low and their high bytes, and back.
void split_words(const uint8_t* from, size_t words, uint8_t* low, uint8_t* high);
void join_words(const uint8_t* low, const uint8_t* high, size_t words, uint8_t* to);

// In place: b[i] = b[i] - b[i - 1] + 128 modulo 256, the first stays; and back.
void to_differences(uint8_t* bytes, size_t count);
void from_differences(uint8_t* bytes, size_t count);

}  // namespace postchain::io
