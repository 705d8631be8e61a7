#include "passes/common/inverse_warp_reference_highlights.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"
#include "passes/common/inverse_warp_reference_surfaces.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kSoftPx = 4;

// Light and mean square of one pixel.
struct Light {
    double light, squares;
};

// The part of a neighbor's light that may differ from this one by chance alone: 1 up to 3 variances
// of a mean of so many samples (8 with the shutter open), 0 from twice that.
double alike(const Settings& settings, Light own, Light other) {
    const double mean = (own.light + other.light) / 2;
    const double variance = ((own.squares + other.squares) / 2 - mean * mean) / settings.samples;
    const double off = (own.light - other.light) * (own.light - other.light);
    if (off == 0) return 1;
    if (!(variance > 0)) return 0;
    return std::clamp(2 - off / ((settings.shutter ? 8 : 3) * variance), 0.0, 1.0);
}

}  // namespace

double light_of_tile(const ImageD& color, int i, int j) {
    double sum = 0;
    int count = 0;
    for (int y = j * kBlockPx; y < std::min((j + 1) * kBlockPx, color.height); ++y)
        for (int x = i * kBlockPx; x < std::min((i + 1) * kBlockPx, color.width); ++x, ++count) {
            const double light = largest(color.pixel(x, y));
            if (std::isfinite(light)) sum += std::clamp(light, 0.0, 1e30);
        }
    return sum / count;
}

Highlights::Highlights(const Settings& settings, double light)
    : settings_(settings), bright_((settings.shutter ? 1 : 2) * light) {}

void Highlights::add(const std::array<double, 4>& seen, double inverse_depth) {
    if (std::abs(settings_.lens->coc.radius_px(inverse_depth)) < kSoftPx) return;
    excess[3] += 1;
    const double high = largest(seen.data());
    if (high <= bright_ || !finite(seen.data())) return;
    for (size_t c = 0; c < 3; ++c) excess[c] += (1 - bright_ / high) * seen[c];
    squares += (high - bright_) * (high - bright_);
}

void share_highlights(const Settings& settings, const ImageD& excess, const ImageD& squares,
                      ImageD& color) {
    const ImageD gathered = color;
    const auto light_at = [&](int x, int y) {
        return Light{largest(excess.pixel(x, y)), squares.at(x, y)};
    };
    for (int y = 0; y < color.height; ++y) {
        for (int x = 0; x < color.width; ++x) {
            const double* own = excess.pixel(x, y);
            if (!(own[3] > 0) || !finite(gathered.pixel(x, y))) continue;
            double sum[4] = {0, 0, 0, 0}, least[3], most[3];
            for (int c = 0; c < 3; ++c) least[c] = most[c] = gathered.at(x, y, c);
            for (int j = y - 1; j <= y + 1; ++j) {
                for (int i = x - 1; i <= x + 1; ++i) {
                    const int px = std::clamp(i, 0, color.width - 1);
                    const int py = std::clamp(j, 0, color.height - 1);
                    const double* other = excess.pixel(px, py);
                    if (other[3] == 0) continue;
                    const double part = alike(settings, light_at(x, y), light_at(px, py));
                    for (int c = 0; c < 4; ++c) sum[c] += part * other[c] + (1 - part) * own[c];
                    const double* around = gathered.pixel(px, py);
                    if (!finite(around)) continue;
                    for (int c = 0; c < 3; ++c) {
                        least[c] = std::min(least[c], around[c]);
                        most[c] = std::max(most[c], around[c]);
                    }
                }
            }
            for (int c = 0; c < 3; ++c)
                color.at(x, y, c) = std::clamp(
                    gathered.at(x, y, c) - own[c] + own[3] / sum[3] * sum[c], least[c], most[c]);
        }
    }
}

}  // namespace postchain::inverse_warp::reference
