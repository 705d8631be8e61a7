#include "tools/sequence/exr/pixel_encode.h"

#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#endif

namespace postchain::io {

namespace {

#if defined(__x86_64__)
// Converts eight values at a time if the CPU has F16C; results are equal to Imath's conversion.
__attribute__((target("avx,f16c"))) void to_half_f16c(const float* from, size_t count,
                                                      uint16_t* to) {
    size_t i = 0;
    for (; i + 8 <= count; i += 8) {
        const __m128i h = _mm256_cvtps_ph(_mm256_loadu_ps(from + i), _MM_FROUND_TO_NEAREST_INT);
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to + i), h);
    }
    for (; i < count; ++i) to[i] = imath_float_to_half(from[i]);
}
__attribute__((target("avx,f16c"))) void to_float_f16c(const uint16_t* from, size_t count,
                                                       float* to) {
    size_t i = 0;
    for (; i + 8 <= count; i += 8) {
        const __m128i h = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + i));
        _mm256_storeu_ps(to + i, _mm256_cvtph_ps(h));
    }
    for (; i < count; ++i) to[i] = imath_half_to_float(from[i]);
}
// Reads cpuid: clang 14's __builtin_cpu_supports does not support "f16c". Its "avx" also checks the
// operating system.
bool has_f16c() {
    static const bool yes = [] {
        unsigned a = 0, b = 0, c = 0, d = 0;
        return __builtin_cpu_supports("avx") && __get_cpuid(1, &a, &b, &c, &d) != 0 &&
               (c & bit_F16C) != 0;
    }();
    return yes;
}
#endif

uint32_t to_uint(float v) {
    if (!(v > 0)) return 0;
    return v >= 4294967295.0f ? 4294967295u : uint32_t(std::llround(double(v)));
}

bool fits_half(float v) {
    return std::abs(v) <= kMaxHalf;
}  // false for NaN

float into_half_range(float v) {
    return std::isnan(v) ? 0.0f : std::clamp(v, -kMaxHalf, kMaxHalf);
}

}  // namespace

void floats_to_halves(const float* from, size_t count, uint16_t* to) {
#if defined(__x86_64__)
    if (has_f16c()) return to_half_f16c(from, count, to);
#endif
    for (size_t i = 0; i < count; ++i) to[i] = imath_float_to_half(from[i]);
}

void halves_to_floats(const uint16_t* from, size_t count, float* to) {
#if defined(__x86_64__)
    if (has_f16c()) return to_float_f16c(from, count, to);
#endif
    for (size_t i = 0; i < count; ++i) to[i] = imath_half_to_float(from[i]);
}

EncodeCounts encode_channels(const std::vector<EncodeTarget>& targets) {
    EncodeCounts counts;
    if (targets.empty()) return counts;
    const size_t width = size_t(targets[0].image->width);
    const size_t height = size_t(targets[0].image->height);
    std::vector<float> row(width);
    std::vector<uint8_t> flags(width);  // 1 overflow, 2 non-finite, 4 in a half channel
    for (size_t y = 0; y < height; ++y) {
        bool flagged = false;
        for (const EncodeTarget& t : targets) {
            const size_t step = size_t(t.image->channels);
            const float* from = t.image->data.data() + y * width * step + size_t(t.index);
            // One cheap test for a whole row; almost every row passes.
            uint32_t bad = 0;
            for (size_t x = 0; x < width; ++x) {
                row[x] = from[x * step];
                bad |= uint32_t(!fits_half(row[x]));
            }
            const bool half = t.type == PixelType::half;
            if (bad != 0) {
                if (!flagged) std::fill(flags.begin(), flags.end(), uint8_t(0));
                flagged = true;
                for (size_t x = 0; x < width; ++x) {
                    if (fits_half(row[x])) continue;
                    const bool finite = std::isfinite(row[x]);
                    if (half) {
                        flags[x] |= uint8_t(finite ? 5 : 6);
                        row[x] = into_half_range(row[x]);
                    } else if (!finite) {
                        flags[x] |= uint8_t(t.finite ? 6 : 2);
                        if (t.finite)
                            row[x] = std::isnan(row[x])
                                         ? 0.0f
                                         : std::copysign(std::numeric_limits<float>::max(), row[x]);
                    }
                }
            }
            if (half) {
                floats_to_halves(row.data(), width,
                                 reinterpret_cast<uint16_t*>(t.bytes) + y * width);
            } else if (t.type == PixelType::float32) {
                std::memcpy(t.bytes + y * width * 4, row.data(), width * 4);
            } else {
                for (size_t x = 0; x < width; ++x) {
                    const uint32_t value = to_uint(row[x]);
                    std::memcpy(t.bytes + (y * width + x) * 4, &value, 4);
                }
            }
        }
        if (!flagged) continue;
        for (const uint8_t f : flags) {
            counts.overflow_pixels += (f & 1) != 0;
            counts.nonfinite_pixels += (f & 2) != 0;
            counts.refused_pixels += (f & 4) != 0;
        }
    }
    return counts;
}

Status check_counts(const std::string& path, const EncodeCounts& counts, HalfOverflow policy) {
    if (policy == HalfOverflow::clamp || counts.refused_pixels == 0) return {};
    const std::string remedy = counts.overflow_pixels == 0 ? "render it less bright"
                               : counts.narrowed           ? "leave {half} out"_keyed
                                                           : "render color as float";
    return Status(StatusCode::output,
                  concat(path, ": ", counts.refused_pixels,
                         " pixels of color do not fit their channels (half holds 65504 at most, "
                         "float 3.4e38), ",
                         counts.nonfinite_pixels,
                         " of them not finite; clamp them ({overflow=clamp}), or "_keyed, remedy));
}

}  // namespace postchain::io
