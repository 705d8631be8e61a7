#include "passes/inverse_warp/reference_starts.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr double kAlikePx = 1;
constexpr double kEqual = 1.001;  // of squares
constexpr int kMoreInRow = 2;

class Blocks {
  public:
    Blocks(const std::vector<Surface>& surfaces, int width, int height, const Settings& settings)
        : surfaces_(surfaces),
          s_(settings),
          width_(width),
          height_(height),
          columns_((width + kBlockPx - 1) / kBlockPx),
          rows_((height + kBlockPx - 1) / kBlockPx),
          blocks_(size_t(columns_ * rows_)),
          row_starts_(blocks_.size()) {}

    std::vector<Block> choose() {
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) choose_surfaces(i, j);
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) choose_in_row(i, j);
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

    // Can a surface be displaced so many blocks along x, or along y?
    bool reaches(const Surface& s, int blocks, bool along_x) const {
        double reach = 1 + 1.1 * std::abs(s.radius);
        if (s_.shutter) {
            const double a = along_x ? s.a.x : s.a.y, b = along_x ? s.b.x : s.b.y;
            reach += std::abs(a) + std::abs(b) + 0.1 * std::sqrt(dot(s.a, s.a));
        }
        return reach >= std::max(std::abs(blocks) - 1, 0) * kBlockPx;
    }

    // Up to `count` surfaces that are displaced most differently.
    std::vector<Surface> most_different(const std::vector<Surface>& candidates, int count) const {
        std::vector<Surface> chosen;
        for (int k = 0; k < count; ++k) {
            double max_apart = kAlikePx * kAlikePx;
            const Surface* next = nullptr;
            for (const Surface& s : candidates) {
                double apart_px2 = k == 0 ? displaced(s, s_) + 2 * kAlikePx * kAlikePx : 3e38;
                for (const Surface& c : chosen) apart_px2 = std::min(apart_px2, apart(s, c, s_));
                if (apart_px2 > max_apart * kEqual) {
                    max_apart = apart_px2;
                    next = &s;
                }
            }
            if (!next) break;
            chosen.push_back(*next);
        }
        return chosen;
    }

    // From the surfaces of the blocks in its row.
    void choose_in_row(int i, int j) {
        std::vector<Surface> candidates;
        for (int x = 0; x < columns_; ++x)
            for (const Surface& s : block(x, j).surfaces)
                if (reaches(s, x - i, true)) candidates.push_back(s);
        row_starts_[size_t(j * columns_ + i)] =
            most_different(candidates, s_.search.starts + kMoreInRow);
    }

    // From those that the rows of its column have chosen.
    void choose_starts(int i, int j) {
        std::vector<Surface> candidates;
        for (int y = 0; y < rows_; ++y)
            for (const Surface& s : row_starts_[size_t(y * columns_ + i)])
                if (reaches(s, y - j, false)) candidates.push_back(s);
        Block& b = block(i, j);
        for (const Surface& s : candidates) b.longest_px = std::max(b.longest_px, longest(s, s_));
        b.starts = most_different(candidates, s_.search.starts);
        std::stable_sort(b.starts.begin(), b.starts.end(), [](const Surface& a, const Surface& c) {
            return a.inverse_depth > c.inverse_depth;
        });
    }

    const std::vector<Surface>& surfaces_;
    const Settings& s_;
    int width_, height_, columns_, rows_;
    std::vector<Block> blocks_;
    std::vector<std::vector<Surface>> row_starts_;
};

}  // namespace

std::vector<Block> blocks_of(const std::vector<Surface>& surfaces, int width, int height,
                             const Settings& settings) {
    return Blocks(surfaces, width, height, settings).choose();
}

}  // namespace postchain::inverse_warp::reference
