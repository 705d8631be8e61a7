#include "tools/scenes/samples.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace postchain::scenes {
namespace {

constexpr int kBits = 32;
using Directions = std::array<uint32_t, kBits>;

// degree, coefficients and first numbers of a primitive polynomial, as Joe and Kuo list them.
Directions directions(int degree, uint32_t coefficients, std::array<uint32_t, 3> first) {
    Directions v{};
    for (int i = 0; i < kBits; ++i) {
        if (degree == 0) {
            v[size_t(i)] = 1u << (kBits - 1 - i);
        } else if (i < degree) {
            v[size_t(i)] = first[size_t(i)] << (kBits - 1 - i);
        } else {
            const uint32_t before = v[size_t(i - degree)];
            uint32_t next = before ^ (before >> degree);
            for (int k = 1; k < degree; ++k)
                if ((coefficients >> (degree - 1 - k)) & 1) next ^= v[size_t(i - k)];
            v[size_t(i)] = next;
        }
    }
    return v;
}

}  // namespace

std::vector<glm::vec4> sample_points(int count) {
    static const std::array<Directions, 4> kSobol = {directions(0, 0, {}), directions(1, 0, {1}),
                                                     directions(2, 1, {1, 3}),
                                                     directions(3, 1, {1, 3, 1})};
    std::vector<glm::vec4> points(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i)
        for (int dimension = 0; dimension < 4; ++dimension) {
            uint32_t bits = 0;
            for (int bit = 0; bit < kBits; ++bit)
                if ((uint32_t(i) >> bit) & 1) bits ^= kSobol[size_t(dimension)][size_t(bit)];
            const double value = bits * 0x1p-32 + 0.5 / count;
            points[size_t(i)][dimension] = float(value - std::floor(value));
        }
    return points;
}

}  // namespace postchain::scenes
