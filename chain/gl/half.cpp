#include "chain/gl/half.h"

#include <bit>

namespace postchain::gl {
namespace {

constexpr uint32_t kInfinity = 0x7f800000u;
constexpr uint32_t kMinNormal = 0x38800000u;  // 2^-14
constexpr uint32_t kTooLarge = 0x47800000u;   // 65536

}  // namespace

// Both without branches, so that they vectorize.
void to_halves(const float* from, uint16_t* to, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const uint32_t bits = std::bit_cast<uint32_t>(from[i]);
        const uint32_t size = bits & 0x7fffffffu;
        const uint32_t normal = (size + 0xfffu + (size >> 13 & 1u) - 0x38000000u) >> 13;
        // The last bit of a float of 0.5 to 1 is the step of subnormal halves.
        const float small = std::bit_cast<float>(size < kMinNormal ? size : 0u);
        const uint32_t subnormal = std::bit_cast<uint32_t>(small + 0.5f) - 0x3f000000u;
        const uint32_t large = size > kInfinity ? 0x7e00u : 0x7c00u;
        const uint32_t half = size < kMinNormal ? subnormal : size < kTooLarge ? normal : large;
        to[i] = uint16_t(half | (bits >> 16 & 0x8000u));
    }
}

void from_halves(const uint16_t* from, float* to, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const uint32_t size = uint32_t(from[i] & 0x7fffu) << 13;
        const uint32_t normal = size + 0x38000000u;
        const uint32_t infinite = size + 0x70000000u;  // NaN too
        // As a normal number with the exponent of 2^-14, less that 2^-14.
        const float small = std::bit_cast<float>((size & 0x7fffffu) + kMinNormal) - 0x1p-14f;
        const uint32_t bits = size < 0x800000u     ? std::bit_cast<uint32_t>(small)
                              : size < 0x0f800000u ? normal
                                                   : infinite;
        to[i] = std::bit_cast<float>(bits | uint32_t(from[i] & 0x8000u) << 16);
    }
}

}  // namespace postchain::gl
