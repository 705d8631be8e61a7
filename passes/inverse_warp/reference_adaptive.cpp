#include "passes/inverse_warp/reference_adaptive.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kNoiseVariance = 0.045;  // of samples, as shown; above it a tile takes more
constexpr double kAllOfThem = 1.25;       // times that: they count as much as the first

}  // namespace

void Halves::add(int number, const std::vector<double>& difference, double weight) {
    const auto half = size_t(std::popcount(unsigned(number)) % 2);
    for (size_t c = 0; c < 3; ++c) sums_[half][c] += weight * difference[c];
    weights_[half] += weight;
}

double Halves::noise(const double* own) const {
    if (weights_[0] == 0 || weights_[1] == 0) return 0;
    const auto shown = [&](size_t half, size_t c) {
        const double light = std::max(own[c] + sums_[half][c] / weights_[half], 0.0);
        return std::sqrt(light / (1 + light));
    };
    double squared = 0;
    for (size_t c = 0; c < 3; ++c) squared += std::pow(shown(0, c) - shown(1, c), 2) / 3;
    return std::isfinite(squared) ? squared : 0;
}

double share_of_more(double noise, int samples) {
    // The means of halves of n samples of variance v differ by 4 v/n in the mean square.
    const double variance = noise * samples / 4;
    return std::clamp((variance / kNoiseVariance - 1) / (kAllOfThem - 1), 0.0, 1.0);
}

}  // namespace postchain::inverse_warp::reference
