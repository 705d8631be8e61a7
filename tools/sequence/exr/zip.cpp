#include "tools/sequence/exr/zip.h"

#include <algorithm>
#include <new>

#if POSTCHAIN_LIBDEFLATE
#include <libdeflate.h>
#else
#include <zlib.h>
#endif
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace postchain::io {

namespace {

#if defined(__SSE2__)
__m128i load(const uint8_t* from) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
}
void store(uint8_t* to, __m128i value) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), value);
}
#endif

}  // namespace

void split_words(const uint8_t* from, size_t words, uint8_t* low, uint8_t* high) {
    size_t i = 0;
#if defined(__SSE2__)
    const __m128i low_mask = _mm_set1_epi16(0xff);
    for (; i + 16 <= words; i += 16) {
        const __m128i a = load(from + 2 * i), b = load(from + 2 * i + 16);
        store(low + i, _mm_packus_epi16(_mm_and_si128(a, low_mask), _mm_and_si128(b, low_mask)));
        store(high + i, _mm_packus_epi16(_mm_srli_epi16(a, 8), _mm_srli_epi16(b, 8)));
    }
#endif
    for (; i < words; ++i) {
        low[i] = from[2 * i];
        high[i] = from[2 * i + 1];
    }
}

void join_words(const uint8_t* low, const uint8_t* high, size_t words, uint8_t* to) {
    size_t i = 0;
#if defined(__SSE2__)
    for (; i + 16 <= words; i += 16) {
        const __m128i a = load(low + i), b = load(high + i);
        store(to + 2 * i, _mm_unpacklo_epi8(a, b));
        store(to + 2 * i + 16, _mm_unpackhi_epi8(a, b));
    }
#endif
    for (; i < words; ++i) {
        to[2 * i] = low[i];
        to[2 * i + 1] = high[i];
    }
}

void to_differences(uint8_t* bytes, size_t count) {
    // From the end, so that b[i - 1] still has its old value.
    size_t i = count;
#if defined(__SSE2__)
    const __m128i half = _mm_set1_epi8(char(0x80));
    for (; i >= 17; i -= 16) {
        const __m128i difference = _mm_sub_epi8(load(bytes + i - 16), load(bytes + i - 17));
        store(bytes + i - 16, _mm_add_epi8(difference, half));
    }
#endif
    for (; i > 1; --i) bytes[i - 1] = uint8_t(bytes[i - 1] - bytes[i - 2] + 128);
}

void from_differences(uint8_t* bytes, size_t count) {
    size_t i = 1;
#if defined(__SSE2__)
    const __m128i half = _mm_set1_epi8(char(0x80));
    if (count >= 17) {
        __m128i last =
            _mm_set1_epi8(char(bytes[0]));  // last byte of the previous sixteen, sixteen times
        for (; i + 16 <= count; i += 16) {
            __m128i sum = _mm_sub_epi8(load(bytes + i), half);
            sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 1));
            sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 2));
            sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 4));
            sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 8));
            sum = _mm_add_epi8(sum, last);
            store(bytes + i, sum);
            const __m128i twice = _mm_shufflehi_epi16(_mm_unpackhi_epi8(sum, sum), 0xff);
            last = _mm_unpackhi_epi64(twice, twice);
        }
    }
#endif
    for (; i < count; ++i) bytes[i] = uint8_t(bytes[i - 1] + bytes[i] - 128);
}

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
