// ZIP and ZIPS of EXR: the low bytes of all 16-bit words, then their high bytes; then each byte
// minus the one before it; then deflate.
//
// Source: "OpenEXR File Layout" and ImfZip.cpp of OpenEXR 3.1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

namespace postchain::io {

// Splits `words` little-endian words into their low and high bytes, and back.
void split_words(const uint8_t* from, size_t words, uint8_t* low, uint8_t* high);
void join_words(const uint8_t* low, const uint8_t* high, size_t words, uint8_t* to);

// In place: b[i] = b[i] - b[i - 1] + 128 modulo 256; b[0] stays. And back.
void to_differences(uint8_t* bytes, size_t count);
void from_differences(uint8_t* bytes, size_t count);

// Deflater and Inflater pack and unpack whole streams in zlib's format (RFC 1950: deflate, then an
// Adler-32). They use libdeflate if the program was built with it, otherwise zlib; either reads
// streams of the other.
inline constexpr int kMaxDeflateLevel = 9;

// One for each thread. Throws std::bad_alloc.
class Deflater {
  public:
    // 0 stores, 1 is the fastest, 9 the smallest; clamped to this range.
    explicit Deflater(int level);
    ~Deflater();
    // Returns the size of the stream; 0 if it does not fit into `room`.
    size_t pack(const std::byte* from, size_t count, std::byte* to, size_t room);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// One for each thread. Throws std::bad_alloc.
class Inflater {
  public:
    Inflater();
    ~Inflater();
    // False if the stream is damaged or does not hold exactly `count` bytes.
    bool unpack(const std::byte* from, size_t packed, std::byte* to, size_t count);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// CRC-32 of ISO 3309, as in PNG's chunks.
uint32_t crc32_of(std::string_view bytes);

// "libdeflate" or "zlib".
const char* deflate_library();

}  // namespace postchain::io
