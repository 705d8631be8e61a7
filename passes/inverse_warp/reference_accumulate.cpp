#include "passes/inverse_warp/reference_accumulate.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kSoftSpread = 8;  // px^2
constexpr double kMaxSpread = 65536;
constexpr double kNoiseVariance = 0.045;  // of samples, as shown; above it a block takes more
constexpr double kFullWeight = 1.25;      // times that: they count as much as the first

// sum + weight color
void add(Color& sum, double weight, const Color& color) {
    for (size_t c = 0; c < sum.size(); ++c) sum[c] += weight * color[c];
}

std::array<double, 3> covariance_of(const Seen& seen, const Settings& settings) {
    std::array<double, 3> covariance = {};
    if (settings.lens) {
        const double radius = settings.lens->coc.radius_px(seen.inverse_depth);
        const auto [x, y] = settings.lens->coc.axes;
        covariance[0] += x * x * radius * radius / 4;
        covariance[2] += y * y * radius * radius / 4;
    }
    if (settings.shutter) {
        covariance[0] += seen.path.x * seen.path.x / 3;
        covariance[1] += seen.path.x * seen.path.y / 3;
        covariance[2] += seen.path.y * seen.path.y / 3;
    }
    return covariance;
}

void add_soft(Soft& soft, const Seen& seen, const Color& difference, double weight,
              const Settings& settings) {
    const auto covariance = covariance_of(seen, settings);
    const double variance = covariance[0] + covariance[2];
    if (variance < kSoftSpread) return;
    const double kept = std::min(kMaxSpread / variance, 1.0);
    add(soft.color, weight, difference);
    soft.weight += weight;
    for (size_t c = 0; c < 3; ++c) soft.spread[c] += weight * kept * covariance[c];
}

void add_to_half(std::array<Half, 2>& halves, int number, const Color& difference, double weight) {
    Half& half = halves[size_t(std::popcount(unsigned(number)) % 2)];
    for (size_t c = 0; c < 3; ++c) half.color[c] += weight * difference[c];
    half.weight += weight;
}

}  // namespace

Sums no_samples(int channels) {
    Sums sums;
    sums.color = sums.soft.color = Color(size_t(channels));
    return sums;
}

void accumulate(Sums& sums, const Pixel& pixel, const Sample& now, const Seen& seen,
                const Settings& settings) {
    Color difference = seen.color;
    for (size_t c = 0; c < difference.size(); ++c) difference[c] -= pixel.color[c];
    const Vec moved_px = seen.at - pixel.p;
    add(sums.color, now.weight, difference);
    sums.weight += now.weight;
    sums.moment += now.weight * dot(moved_px, moved_px);
    add_to_half(sums.halves, now.number, difference, now.weight);
    add_soft(sums.soft, seen, difference, now.weight, settings);
}

double noise_of(const std::array<Half, 2>& halves, const double* own) {
    if (halves[0].weight == 0 || halves[1].weight == 0) return 0;
    const auto shown = [&](const Half& half, size_t c) {
        const double light = std::max(own[c] + half.color[c] / half.weight, 0.0);
        return std::sqrt(light / (1 + light));
    };
    double squared = 0;
    for (size_t c = 0; c < 3; ++c)
        squared += std::pow(shown(halves[0], c) - shown(halves[1], c), 2) / 3;
    return squared;
}

double weight_of_more(double noise, int samples) {
    // The means of halves of n samples of variance v differ by 4 v/n in the mean square.
    const double variance = noise * samples / 4;
    return std::clamp((variance / kNoiseVariance - 1) / (kFullWeight - 1), 0.0, 1.0);
}

}  // namespace postchain::inverse_warp::reference
