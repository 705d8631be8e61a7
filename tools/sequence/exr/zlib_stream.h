// Packs and unpacks whole streams in zlib's format (RFC 1950: deflate, then an Adler-32), as in ZIP
// and ZIPS of EXR. Uses libdeflate if the program was built with it, otherwise zlib; either reads
// streams of the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

namespace postchain::io {

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
