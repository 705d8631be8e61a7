#include "tools/measure/scenes/samples.h"

#include <cmath>
#include <cstdint>

namespace postchain::scenes {
namespace {

// Van der Corput's sequence in base 2 and Sobol's second dimension: the generator matrices are the
// identity and Pascal's triangle modulo 2.
double van_der_corput(uint32_t i) {
    uint32_t bits = 0;
    for (int bit = 0; bit < 32; ++bit) bits |= ((i >> bit) & 1) << (31 - bit);
    return bits * 0x1p-32;
}

double sobol(uint32_t i) {
    uint32_t bits = 0;
    for (uint32_t column = 1u << 31; i != 0; i >>= 1, column ^= column >> 1)
        if (i & 1) bits ^= column;
    return bits * 0x1p-32;
}

float fraction(double value) {
    const float rest = float(value - std::floor(value));
    return rest < 1 ? rest : 0;  // rounded up
}

}  // namespace

std::vector<glm::vec4> sample_points(int count, bool lens) {
    constexpr double kPlastic = 1.32471795724474602596;
    std::vector<glm::vec4> points(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double half = 0.5 / count;
        const glm::vec2 even(fraction(van_der_corput(uint32_t(i)) + half),
                             fraction(sobol(uint32_t(i)) + half));
        const glm::vec2 other(fraction(0.5 + i / kPlastic),
                              fraction(0.5 + i / (kPlastic * kPlastic)));
        points[size_t(i)] = lens ? glm::vec4(even, other) : glm::vec4(other, even);
    }
    return points;
}

}  // namespace postchain::scenes
