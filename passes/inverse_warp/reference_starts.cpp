#include "passes/inverse_warp/reference_starts.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kAlikePx = 1;
constexpr double kEqual = 1.001;  // of squares

class Blocks {
  public:
    Blocks(const std::vector<Surface>& surfaces, int width, int height, const Settings& settings)
        : surfaces_(surfaces),
          s_(settings),
          width_(width),
          height_(height),
          columns_((width + kBlockPx - 1) / kBlockPx),
          rows_((height + kBlockPx - 1) / kBlockPx),
          blocks_(size_t(columns_ * rows_)) {}

    std::vector<Block> choose() {
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) choose_surfaces(i, j);
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) choose_starts(i, j);
        return std::move(blocks_);
    }

  private:
    size_t index(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    Block& block(int i, int j) { return blocks_[size_t(j * columns_ + i)]; }

    // The three surfaces of a block that are displaced most differently.
    void choose_surfaces(int i, int j) {
        Block& b = block(i, j);
        const auto farthest = [&](const auto& measure) {
            double max_apart = -1;
            Surface best;
            for (int y = j * kBlockPx; y < std::min((j + 1) * kBlockPx, height_); ++y)
                for (int x = i * kBlockPx; x < std::min((i + 1) * kBlockPx, width_); ++x)
                    if (const double m = measure(surfaces_[index(x, y)]); m > max_apart * kEqual) {
                        max_apart = m;
                        best = surfaces_[index(x, y)];
                    }
            return best;
        };
        b.surfaces[0] = farthest([&](const Surface& s) { return displaced(s, s_); });
        b.surfaces[1] = farthest([&](const Surface& s) { return apart(s, b.surfaces[0], s_); });
        b.surfaces[2] = farthest([&](const Surface& s) {
            return std::min(apart(s, b.surfaces[0], s_), apart(s, b.surfaces[1], s_));
        });
    }

    // Can a surface of the block at this offset (in blocks) be displaced into this block?
    bool reaches(const Surface& s, int offset_x, int offset_y) const {
        const auto covers = [&](double a, double b, int offset) {
            double reach = 1 + 1.1 * std::abs(s.radius);
            if (s_.shutter) reach += std::abs(a) + std::abs(b) + 0.1 * std::sqrt(dot(s.a, s.a));
            return reach >= std::max(std::abs(offset) - 1, 0) * kBlockPx;
        };
        return covers(s.a.x, s.b.x, offset_x) && covers(s.a.y, s.b.y, offset_y);
    }

    // Surfaces that can be displaced into this block, in row order.
    std::vector<Surface> reaching(int i, int j) {
        std::vector<Surface> found;
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x)
                for (const Surface& s : block(x, y).surfaces)
                    if (reaches(s, x - i, y - j)) found.push_back(s);
        return found;
    }

    void choose_starts(int i, int j) {
        Block& b = block(i, j);
        const std::vector<Surface> candidates = reaching(i, j);
        for (const Surface& s : candidates) b.longest_px = std::max(b.longest_px, longest(s, s_));
        for (int k = 0; k < s_.search.starts; ++k) {
            double max_apart = kAlikePx * kAlikePx;
            const Surface* next = nullptr;
            for (const Surface& s : candidates) {
                double apart_px2 = k == 0 ? displaced(s, s_) + 2 * kAlikePx * kAlikePx : 3e38;
                for (const Surface& chosen : b.starts)
                    apart_px2 = std::min(apart_px2, apart(s, chosen, s_));
                if (apart_px2 > max_apart * kEqual) {
                    max_apart = apart_px2;
                    next = &s;
                }
            }
            if (!next) break;
            b.starts.push_back(*next);
        }
        std::stable_sort(b.starts.begin(), b.starts.end(), [](const Surface& a, const Surface& c) {
            return a.inverse_depth > c.inverse_depth;
        });
    }

    const std::vector<Surface>& surfaces_;
    const Settings& s_;
    int width_, height_, columns_, rows_;
    std::vector<Block> blocks_;
};

}  // namespace

std::vector<Block> blocks_of(const std::vector<Surface>& surfaces, int width, int height,
                             const Settings& settings) {
    return Blocks(surfaces, width, height, settings).choose();
}

}  // namespace postchain::inverse_warp::reference
