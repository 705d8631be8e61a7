#include "passes/inverse_warp/reference_background.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kEdgePart = 0.25;

int block_count(int pixels) {
    return (pixels + kBlockPx - 1) / kBlockPx;
}

}  // namespace

// Quarter by quarter: a farther surface replaces the one so far, the same one is averaged with it.
Background::Cell Background::merge(const std::array<Cell, 4>& quarters) {
    Cell whole;
    for (const Cell& quarter : quarters) {
        if (quarter.part == 0) continue;
        const bool same = whole.part > 0 && one_depth(whole.inverse_depth, quarter.inverse_depth);
        if (whole.part > 0 && !same && whole.inverse_depth < quarter.inverse_depth) continue;
        if (!same) {
            whole = quarter;
            continue;
        }
        const double part = whole.part + quarter.part;
        for (size_t c = 0; c < whole.color.size(); ++c)
            whole.color[c] = (whole.part * whole.color[c] + quarter.part * quarter.color[c]) / part;
        whole.inverse_depth = std::min(whole.inverse_depth, quarter.inverse_depth);
        whole.part = part;
    }
    whole.part /= 4;
    return whole;
}

Background::Background(const ImageD& color, const std::vector<Surface>& surfaces) {
    Level pixels{1, kBlockPx * block_count(color.width), kBlockPx * block_count(color.height), {}};
    pixels.cells.resize(size_t(pixels.columns) * size_t(pixels.rows));
    for (int y = 0; y < color.height; ++y)
        for (int x = 0; x < color.width; ++x) {
            const double* c = color.pixel(x, y);
            const Surface& s = surfaces[size_t(y) * size_t(color.width) + size_t(x)];
            Cell& cell = pixels.cells[size_t(y) * size_t(pixels.columns) + size_t(x)];
            cell.color.assign(c, c + color.channels);
            cell.inverse_depth = s.inverse_depth;
            cell.part = s.edge ? kEdgePart : 1;
        }
    levels_.push_back(std::move(pixels));
    while (levels_.back().edge_px < kBlockPx) {
        const Level& fine = levels_.back();
        Level coarse{2 * fine.edge_px, fine.columns / 2, fine.rows / 2, {}};
        for (int y = 0; y < coarse.rows; ++y)
            for (int x = 0; x < coarse.columns; ++x) {
                const auto quarter = [&](int i, int j) {
                    return fine.cells[size_t(2 * y + j) * size_t(fine.columns) + size_t(2 * x + i)];
                };
                coarse.cells.push_back(
                    merge({quarter(0, 0), quarter(1, 0), quarter(0, 1), quarter(1, 1)}));
            }
        levels_.push_back(std::move(coarse));
    }
    levels_.erase(levels_.begin());
}

Color Background::at(Vec at, double inverse_depth, const Color& otherwise) const {
    for (const Level& level : levels_) {
        const double x = (at.x + 0.5) / level.edge_px - 0.5, y = (at.y + 0.5) / level.edge_px - 0.5;
        Color sum(otherwise.size());
        double total = 0;
        for (int j = int(std::floor(y)); j <= int(std::floor(y)) + 1; ++j)
            for (int i = int(std::floor(x)); i <= int(std::floor(x)) + 1; ++i) {
                const Cell& cell =
                    level.cells[size_t(std::clamp(j, 0, level.rows - 1)) * size_t(level.columns) +
                                size_t(std::clamp(i, 0, level.columns - 1))];
                const double weight = (1 - std::abs(x - i)) * (1 - std::abs(y - j)) * cell.part;
                if (weight == 0 || cell.inverse_depth > kOneDepth * inverse_depth) continue;
                for (size_t c = 0; c < sum.size(); ++c) sum[c] += weight * cell.color[c];
                total += weight;
            }
        if (total == 0) continue;
        for (double& c : sum) c /= total;
        return sum;
    }
    return otherwise;
}

}  // namespace postchain::inverse_warp::reference
