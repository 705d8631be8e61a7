#include "passes/inverse_warp/reference_background.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "chain/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kEdgePart = 0.25;
constexpr double kShows = 0.3, kOneColor = 0.25;
constexpr std::array<int, 6> kDistances = {1, 2, 3, 5, 9, 16};
constexpr std::array<std::array<int, 2>, 4> kLines = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};

std::array<int, 2> along(std::array<int, 2> cell, std::array<int, 2> line, int distance) {
    return {cell[0] + distance * line[0], cell[1] + distance * line[1]};
}

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
    columns_ = (color.width + 1) / 2;
    rows_ = (color.height + 1) / 2;
}

const Background::Cell& Background::smallest(std::array<int, 2> cell) const {
    return levels_[0].cells[size_t(cell[1]) * size_t(levels_[0].columns) + size_t(cell[0])];
}

int Background::distance_behind(std::array<int, 2> cell, std::array<int, 2> line, double q) const {
    double behind = -1;
    for (const int distance : kDistances) {
        const auto [x, y] = along(cell, line, distance);
        if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return 0;
        const Cell& shown = smallest({x, y});
        if (shown.part == 0) return 0;
        if (behind < 0 && shown.inverse_depth * kOneDepth < q) behind = shown.inverse_depth;
        if (behind < 0) continue;
        if (!one_depth(shown.inverse_depth, behind)) return 0;
        if (shown.part > kShows) return distance;
    }
    return 0;
}

bool Background::one_surface(const Sides& sides) const {
    const Cell &a = smallest(sides.first), &b = smallest(sides.second);
    const auto toned = [](double c) { return c / (1 + std::abs(c)); };
    for (size_t c = 0; c < 3; ++c)
        if (std::abs(toned(a.color[c]) - toned(b.color[c])) >= kOneColor) return false;
    return one_depth(a.inverse_depth, b.inverse_depth);
}

std::optional<Background::Sides> Background::sides_of(Vec x, double q) const {
    const std::array<int, 2> cell = {int(x.x) / 2, int(x.y) / 2};
    const double own = smallest(cell).inverse_depth;
    if (own * kOneDepth < q) return Sides{cell, cell};
    double shortest = std::numeric_limits<double>::infinity();
    std::optional<Sides> sides;
    for (const auto& line : kLines) {
        const int a = distance_behind(cell, line, own);
        const int b = distance_behind(cell, {-line[0], -line[1]}, own);
        const double span = (a + b) * std::hypot(line[0], line[1]);
        if (a == 0 || b == 0 || span >= shortest) continue;
        shortest = span;
        sides = Sides{along(cell, line, a), along(cell, line, -b)};
        if (!one_surface(*sides)) sides.reset();
    }
    return sides;
}

Color Background::color_behind(const Sides& sides, Vec at) const {
    const Vec a = {double(sides.first[0]), double(sides.first[1])};
    const Vec way = Vec{double(sides.second[0]), double(sides.second[1])} - a;
    const double share =
        std::clamp(dot(0.5 * at - a, way) / std::max(dot(way, way), 1.0), 0.0, 1.0);
    Color color = smallest(sides.first).color;
    const Color& other = smallest(sides.second).color;
    for (size_t c = 0; c < color.size(); ++c) color[c] += share * (other[c] - color[c]);
    return color;
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
