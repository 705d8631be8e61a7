#include "passes/inverse_warp/reference_tiles.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kAlikePx = 1;
constexpr double kAlike = 1.001;  // of squares

class Tiles {
  public:
    Tiles(const std::vector<Surface>& surfaces, int width, int height, const Settings& settings)
        : surfaces_(surfaces),
          s_(settings),
          width_(width),
          height_(height),
          columns_((width + kBlockPx - 1) / kBlockPx),
          rows_((height + kBlockPx - 1) / kBlockPx),
          tiles_(size_t(columns_ * rows_)) {}

    std::vector<Tile> pick() {
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) pick_surfaces(i, j);
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) pick_starts(i, j);
        return std::move(tiles_);
    }

  private:
    size_t index(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    Tile& tile(int i, int j) { return tiles_[size_t(j * columns_ + i)]; }

    // The three surfaces of a tile that are displaced most differently.
    void pick_surfaces(int i, int j) {
        Tile& t = tile(i, j);
        const auto farthest = [&](const auto& measure) {
            double most = -1;
            Surface best;
            for (int y = j * kBlockPx; y < std::min((j + 1) * kBlockPx, height_); ++y)
                for (int x = i * kBlockPx; x < std::min((i + 1) * kBlockPx, width_); ++x)
                    if (const double m = measure(surfaces_[index(x, y)]); m > most * kAlike) {
                        most = m;
                        best = surfaces_[index(x, y)];
                    }
            return best;
        };
        t.surfaces[0] = farthest([&](const Surface& s) { return displaced(s, s_); });
        t.surfaces[1] = farthest([&](const Surface& s) { return apart(s, t.surfaces[0], s_); });
        t.surfaces[2] = farthest([&](const Surface& s) {
            return std::min(apart(s, t.surfaces[0], s_), apart(s, t.surfaces[1], s_));
        });
    }

    // Surfaces that can be displaced into this tile, in row order.
    std::vector<Surface> meeting(int i, int j) {
        std::vector<Surface> found;
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x)
                for (const Surface& s : tile(x, y).surfaces) {
                    const double aside = 1.1 * std::abs(s.radius) + 1;
                    const int gap_x = std::max(std::abs(x - i) - 1, 0) * kBlockPx;
                    const int gap_y = std::max(std::abs(y - j) - 1, 0) * kBlockPx;
                    const double along = s_.shutter ? 0.1 * std::sqrt(dot(s.a, s.a)) : 0;
                    const auto reach = [&](double a, double b) {
                        return aside + along + (s_.shutter ? std::abs(a) + std::abs(b) : 0);
                    };
                    if (reach(s.a.x, s.b.x) >= gap_x && reach(s.a.y, s.b.y) >= gap_y)
                        found.push_back(s);
                }
        return found;
    }

    void pick_starts(int i, int j) {
        Tile& t = tile(i, j);
        const std::vector<Surface> candidates = meeting(i, j);
        for (const Surface& s : candidates) t.longest = std::max(t.longest, longest(s, s_));
        for (int k = 0; k < s_.search.starts; ++k) {
            double most = kAlikePx * kAlikePx;
            const Surface* next = nullptr;
            for (const Surface& s : candidates) {
                double least = k == 0 ? displaced(s, s_) + 2 * kAlikePx * kAlikePx : 3e38;
                for (const Surface& chosen : t.starts)
                    least = std::min(least, apart(s, chosen, s_));
                if (least > most * kAlike) {
                    most = least;
                    next = &s;
                }
            }
            if (!next) break;
            t.starts.push_back(*next);
        }
        std::stable_sort(t.starts.begin(), t.starts.end(), [](const Surface& a, const Surface& b) {
            return a.inverse_depth > b.inverse_depth;
        });
    }

    const std::vector<Surface>& surfaces_;
    const Settings& s_;
    int width_, height_, columns_, rows_;
    std::vector<Tile> tiles_;
};

}  // namespace

std::vector<Tile> tiles_of(const std::vector<Surface>& surfaces, int width, int height,
                           const Settings& settings) {
    return Tiles(surfaces, width, height, settings).pick();
}

}  // namespace postchain::inverse_warp::reference
