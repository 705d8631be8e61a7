#include "tools/sequence/exr/zlib_stream.h"

#include <algorithm>
#include <new>

#if POSTCHAIN_LIBDEFLATE
#include <libdeflate.h>
#else
#include <zlib.h>
#endif

namespace postchain::io {

#if POSTCHAIN_LIBDEFLATE

struct Deflater::Impl {
    libdeflate_compressor* compressor;
    explicit Impl(int level) : compressor(libdeflate_alloc_compressor(level)) {
        if (compressor == nullptr) throw std::bad_alloc();
    }
    ~Impl() { libdeflate_free_compressor(compressor); }
};

struct Inflater::Impl {
    libdeflate_decompressor* decompressor = libdeflate_alloc_decompressor();
    Impl() {
        if (decompressor == nullptr) throw std::bad_alloc();
    }
    ~Impl() { libdeflate_free_decompressor(decompressor); }
};

size_t Deflater::pack(const std::byte* from, size_t count, std::byte* to, size_t room) {
    return libdeflate_zlib_compress(impl_->compressor, from, count, to, room);
}

bool Inflater::unpack(const std::byte* from, size_t packed, std::byte* to, size_t count) {
    // With null for the actual size, libdeflate demands exactly `count` bytes.
    return libdeflate_zlib_decompress(impl_->decompressor, from, packed, to, count, nullptr) ==
           LIBDEFLATE_SUCCESS;
}

uint32_t crc32_of(std::string_view bytes) {
    return libdeflate_crc32(0, bytes.data(), bytes.size());
}

const char* deflate_library() {
    return "libdeflate";
}

#else

struct Deflater::Impl {
    int level;
    explicit Impl(int l) : level(l) {}
};

struct Inflater::Impl {};

size_t Deflater::pack(const std::byte* from, size_t count, std::byte* to, size_t room) {
    uLongf size = room;
    const int result = compress2(reinterpret_cast<Bytef*>(to), &size,
                                 reinterpret_cast<const Bytef*>(from), count, impl_->level);
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    return result == Z_OK ? size_t(size) : 0;
}

bool Inflater::unpack(const std::byte* from, size_t packed, std::byte* to, size_t count) {
    uLongf size = count;
    const int result = uncompress(reinterpret_cast<Bytef*>(to), &size,
                                  reinterpret_cast<const Bytef*>(from), packed);
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    return result == Z_OK && size == count;
}

uint32_t crc32_of(std::string_view bytes) {
    return uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

const char* deflate_library() {
    return "zlib";
}

#endif

Deflater::Deflater(int level)
    : impl_(std::make_unique<Impl>(std::clamp(level, 0, kMaxDeflateLevel))) {}
Deflater::~Deflater() = default;
Inflater::Inflater() : impl_(std::make_unique<Impl>()) {}
Inflater::~Inflater() = default;

}  // namespace postchain::io
