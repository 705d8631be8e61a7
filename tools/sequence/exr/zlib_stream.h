// Whole streams in zlib's format (RFC 1950: deflate with an Adler-32 at its end), as ZIP and ZIPS
// of EXR hold them. By libdeflate where the program was built with it, else by zlib: which of them
// has made a stream, its reader cannot tell.
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
    // 0 stores, 1 is the fastest, 9 the smallest; others are moved to the nearest.
    explicit Deflater(int level);
    ~Deflater();
    // Bytes of the stream; 0 where it does not fit into `room`.
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
    // False where the stream is damaged, or holds another number of bytes than `count`.
    bool unpack(const std::byte* from, size_t packed, std::byte* to, size_t count);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// CRC-32 of ISO 3309, as PNG's chunks have it.
uint32_t crc32_of(std::string_view bytes);

// "libdeflate" or "zlib".
const char* deflate_library();

}  // namespace postchain::io
