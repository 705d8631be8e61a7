#include "passes/inverse_warp/reference_denoise.h"

#include <algorithm>
#include <cmath>

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kSoftSpread = 8;  // px^2
constexpr double kMostSpread = 65536;
constexpr int kReachPx = 2;
constexpr double kLeastWeight = 1.0 / 64;
constexpr double kPixelVariance = 1.0 / 12;

}  // namespace

void Soft::add(const Settings& settings, const std::vector<double>& difference,
               double inverse_depth, Vec path, double sample_weight) {
    std::array<double, 3> covariance = {};
    if (settings.lens) {
        const double radius = settings.lens->coc.radius_px(inverse_depth);
        covariance[0] += radius * radius / 4;
        covariance[2] += radius * radius / 4;
    }
    if (settings.shutter) {
        covariance[0] += path.x * path.x / 3;
        covariance[1] += path.x * path.y / 3;
        covariance[2] += path.y * path.y / 3;
    }
    const double variance = covariance[0] + covariance[2];
    if (variance < kSoftSpread || !finite(difference.data())) return;
    const double kept = std::min(kMostSpread / variance, 1.0);
    sum.resize(difference.size());
    for (size_t c = 0; c < sum.size(); ++c) sum[c] += sample_weight * difference[c];
    for (size_t c = 0; c < 3; ++c) spread[c] += sample_weight * kept * covariance[c];
    weight += sample_weight;
}

void denoise(const Settings& settings, const ImageD& seen, const ImageD& shares,
             const ImageD& spread, ImageD& color) {
    const double window = (settings.shutter ? 4.2 : 5.7) * std::sqrt(settings.samples);
    const ImageD gathered = color;
    for (int y = 0; y < color.height; ++y) {
        for (int x = 0; x < color.width; ++x) {
            const double share = shares.at(x, y);
            if (!(share > 0) || !finite(gathered.pixel(x, y))) continue;
            const double xx = spread.at(x, y, 0) + kPixelVariance, xy = spread.at(x, y, 1);
            const double yy = spread.at(x, y, 2) + kPixelVariance;
            std::vector<double> sums(size_t(color.channels), 0.0);
            double total = 0;
            for (int j = std::max(y - kReachPx, 0); j <= std::min(y + kReachPx, color.height - 1);
                 ++j) {
                for (int i = std::max(x - kReachPx, 0);
                     i <= std::min(x + kReachPx, color.width - 1); ++i) {
                    const double dx = i - x, dy = j - y;
                    // d^T covariance^-1 d
                    const double form =
                        (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
                    const double weight =
                        shares.at(i, j) * std::max(std::exp(-window * form) - kLeastWeight, 0.0);
                    if (weight == 0) continue;
                    for (size_t c = 0; c < sums.size(); ++c)
                        sums[c] += weight * (seen.at(i, j, int(c)) - seen.at(x, y, int(c)));
                    total += weight;
                }
            }
            for (int c = 0; c < color.channels; ++c)
                color.at(x, y, c) = gathered.at(x, y, c) + share / total * sums[size_t(c)];
        }
    }
}

}  // namespace postchain::inverse_warp::reference
