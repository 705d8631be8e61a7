#include "passes/inverse_warp/reference_denoise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr int kReachPx = 2;
constexpr double kMinWeight = 1.0 / 64;

}  // namespace

void denoise(const Settings& settings, const ImageD& soft, const ImageD& shares,
             const ImageD& spread, ImageD& color) {
    const double window = (settings.shutter ? 4.2 : 5.7) * std::sqrt(settings.samples);
    const ImageD gathered = color;
    for (int y = 0; y < color.height; ++y) {
        for (int x = 0; x < color.width; ++x) {
            const double share = shares.at(x, y);
            if (!(share > 0)) continue;
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
                        shares.at(i, j) * std::max(std::exp(-window * form) - kMinWeight, 0.0);
                    if (weight == 0) continue;
                    for (size_t c = 0; c < sums.size(); ++c)
                        sums[c] += weight * (soft.at(i, j, int(c)) - soft.at(x, y, int(c)));
                    total += weight;
                }
            }
            for (int c = 0; c < color.channels; ++c)
                color.at(x, y, c) = gathered.at(x, y, c) + share / total * sums[size_t(c)];
        }
    }
}

}  // namespace postchain::inverse_warp::reference
