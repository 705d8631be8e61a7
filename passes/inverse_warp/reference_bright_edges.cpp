#include "passes/inverse_warp/reference_bright_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace postchain::inverse_warp::reference {
namespace {

constexpr std::array<std::array<int, 2>, 4> kAround = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

class BrightEdges {
  public:
    BrightEdges(const ImageD& color, const std::vector<Surface>& surfaces, const Settings& settings)
        : color_(color), surfaces_(surfaces), settings_(settings) {}

    std::vector<Surface> repaired() const {
        std::vector<Surface> result;
        std::vector<char> changed;
        for (int y = 0; y < color_.height; ++y)
            for (int x = 0; x < color_.width; ++x) {
                const Surface* shown = shown_at(x, y);
                changed.push_back(shown != nullptr);
                result.push_back(shown ? *shown : surface(x, y));
            }
        // What has changed is an edge to those around it.
        const std::vector<Surface> inner = result;
        for (int y = 0; y < color_.height; ++y)
            for (int x = 0; x < color_.width; ++x)
                for (const auto& [i, j] : kAround) {
                    if (!inside(x + i, y + j) || !changed[index(x + i, y + j)]) continue;
                    Surface& own = result[index(x, y)];
                    own.edge = own.edge || !one_depth(own.inverse_depth,
                                                      inner[index(x + i, y + j)].inverse_depth);
                }
        return result;
    }

  private:
    bool inside(int x, int y) const {
        return x >= 0 && y >= 0 && x < color_.width && y < color_.height;
    }
    size_t index(int x, int y) const { return size_t(y) * size_t(color_.width) + size_t(x); }
    const Surface& surface(int x, int y) const { return surfaces_[index(x, y)]; }
    bool same(int x, int y, int i, int j) const {
        return one_depth(surface(x, y).inverse_depth, surface(i, j).inverse_depth);
    }
    bool finite_at(int x, int y) const { return finite(color_.pixel(x, y)); }
    double light(int x, int y) const { return largest(color_.pixel(x, y)); }

    // The surface next to a pixel whose light it shows; null: it shows its own.
    const Surface* shown_at(int x, int y) const {
        const Surface& own = surface(x, y);
        if (!own.edge || !finite_at(x, y) || light(x, y) <= 0) return nullptr;
        const Surface* brightest = nullptr;
        double most = 0;
        for (const auto& [i, j] : kAround) {
            if (!inside(x + i, y + j) || same(x, y, x + i, y + j) || !finite_at(x + i, y + j) ||
                light(x + i, y + j) <= most)
                continue;
            most = light(x + i, y + j);
            brightest = &surface(x + i, y + j);
        }
        if (!brightest || most <= 1.1 * light(x, y)) return nullptr;
        if (apart(own, *brightest, settings_) <= 1) return nullptr;
        // What stays where it is keeps the light of what is behind it.
        if (brightest->inverse_depth < own.inverse_depth && longest(own, settings_) <= 3)
            return nullptr;
        const auto around = light_around(x, y);
        if (!around || light(x, y) <= 4 * *around || most <= 20 * *around) return nullptr;
        return brightest;
    }

    // Of the mean of the pixel's surface away from edges, in the square of 3 or else 5 pixels.
    std::optional<double> light_around(int x, int y) const {
        for (const int reach : {1, 2}) {
            std::array<double, 3> sum = {};
            int count = 0;
            for (int j = y - reach; j <= y + reach; ++j)
                for (int i = x - reach; i <= x + reach; ++i) {
                    if (!inside(i, j) || surface(i, j).edge || !same(x, y, i, j) ||
                        !finite_at(i, j))
                        continue;
                    for (size_t c = 0; c < 3; ++c) sum[c] += color_.at(i, j, int(c));
                    ++count;
                }
            if (count > 0) return std::max({sum[0], sum[1], sum[2]}) / count;
        }
        return std::nullopt;
    }

    const ImageD& color_;
    const std::vector<Surface>& surfaces_;
    const Settings& settings_;
};

}  // namespace

std::vector<Surface> with_bright_edges(const ImageD& color, const std::vector<Surface>& surfaces,
                                       const Settings& settings) {
    return BrightEdges(color, surfaces, settings).repaired();
}

}  // namespace postchain::inverse_warp::reference
