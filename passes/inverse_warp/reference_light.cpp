#include "passes/inverse_warp/reference_light.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "chain/convert.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr int kCellPx = 8, kStepPx = 2, kRings = 2, kMinPixels = 4;
constexpr double kOneMotionPx = 1, kOneMotion = 0.5, kMinDifference = 0.004;

class Comparison {
  public:
    Comparison(const Lit& here, const Lit& there, double offset, const Settings& settings)
        : here_(finite_color(here.color)),
          there_(finite_color(there.color)),
          surfaces_here_(here.surfaces),
          surfaces_there_(there.surfaces),
          half_open_(half_open_of(settings)),
          columns_((here_.width + kCellPx - 1) / kCellPx),
          rows_((here_.height + kCellPx - 1) / kCellPx) {
        now_.u = -offset / half_open_;
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x) cells_.push_back(light_of(x, y));
    }

    // Is the light other around surface s, seen in the neighbor's pixel x, y?
    bool has_other_light(const Surface& s, int x, int y) const {
        if (s.inverse_depth < 0 || shown_here(s, x, y)) return false;
        for (int ring = 0; ring <= kRings; ++ring) {
            Light sum;
            double apart = 0;
            for (int j = -ring; j <= ring; ++j)
                for (int i = -ring; i <= ring; ++i) {
                    if (std::max(std::abs(i), std::abs(j)) != ring) continue;
                    const Light* cell = cell_at(x / kCellPx + i, y / kCellPx + j);
                    if (!cell || cell->count == 0 ||
                        !one_depth(cell->inverse_depth, s.inverse_depth))
                        continue;
                    ++sum.count;
                    sum.here += cell->here;
                    sum.square += cell->square;
                    apart += (cell->there - cell->here) * (cell->there - cell->here);
                }
            if (sum.count == 0) continue;
            const double mean = sum.here / sum.count;
            const double variance = std::max(sum.square / sum.count - mean * mean, 0.0);
            return apart / sum.count > variance + kMinDifference;
        }
        return false;
    }

  private:
    // The farthest surface of a cell that both frames show: means of its brightness.
    struct Light {
        double inverse_depth = 0;  // of its last pixel
        int count = 0;             // 0: none is known
        double here = 0, there = 0, square = 0;
    };
    struct Place {
        int x = 0, y = 0;
    };

    // The pixel of this frame that shows surface s, seen in the neighbor's pixel x, y.
    std::optional<Place> shown_here(const Surface& s, int x, int y) const {
        const Vec at = Vec{double(x), double(y)} + s.displacement(now_, half_open_);
        const double px = std::floor(at.x + 0.5), py = std::floor(at.y + 0.5);
        if (px < 0 || py < 0 || px >= here_.width || py >= here_.height) return std::nullopt;
        const Surface& t = surfaces_here_[size_t(py) * size_t(here_.width) + size_t(px)];
        const Vec apart = s.a - t.a;
        if (t.edge || !one_depth(s.inverse_depth, t.inverse_depth) ||
            dot(apart, apart) >
                kOneMotionPx * kOneMotionPx + kOneMotion * kOneMotion * dot(t.a, t.a))
            return std::nullopt;
        return Place{int(px), int(py)};
    }

    static double brightness(const double* color) {
        double sum = 0;
        for (int c = 0; c < 3; ++c) sum += std::max(color[c], 0.0) / (1 + std::max(color[c], 0.0));
        return sum / 3;
    }

    Light light_of(int column, int row) const {
        struct Pixel {
            double inverse_depth, here, there;
        };
        std::vector<Pixel> pixels;
        for (int y = row * kCellPx; y < std::min((row + 1) * kCellPx, here_.height); y += kStepPx)
            for (int x = column * kCellPx; x < std::min((column + 1) * kCellPx, here_.width);
                 x += kStepPx) {
                const Surface& s = surfaces_there_[size_t(y) * size_t(here_.width) + size_t(x)];
                if (s.edge || s.inverse_depth < 0) continue;
                if (const auto at = shown_here(s, x, y))
                    pixels.push_back({s.inverse_depth, brightness(here_.pixel(at->x, at->y)),
                                      brightness(there_.pixel(x, y))});
            }
        // One pass: a pixel that is farther than the surface so far begins anew.
        Light light;
        for (const Pixel& pixel : pixels) {
            if (light.count > 0 && pixel.inverse_depth > kOneDepth * light.inverse_depth) continue;
            if (light.count > 0 && kOneDepth * pixel.inverse_depth < light.inverse_depth)
                light = {};
            light.inverse_depth = pixel.inverse_depth;
            ++light.count;
            light.here += pixel.here;
            light.there += pixel.there;
            light.square += pixel.here * pixel.here;
        }
        if (light.count < kMinPixels) return {};
        light.here /= light.count;
        light.there /= light.count;
        light.square /= light.count;
        return light;
    }

    const Light* cell_at(int column, int row) const {
        if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return nullptr;
        return &cells_[size_t(row) * size_t(columns_) + size_t(column)];
    }

    const ImageD here_, there_;
    const std::vector<Surface>& surfaces_here_;
    const std::vector<Surface>& surfaces_there_;
    const double half_open_;
    const int columns_, rows_;
    Sample now_;  // this frame's time as seen from the neighbor
    std::vector<Light> cells_;
};

}  // namespace

void hide_other_light(const Lit& here, const Lit& there, double offset, const Settings& settings,
                      std::vector<Surface>& shown) {
    const Comparison comparison(here, there, offset, settings);
    const size_t width = size_t(here.color.width);
    for (size_t i = 0; i < shown.size(); ++i)
        if (comparison.has_other_light(shown[i], int(i % width), int(i / width)))
            shown[i].inverse_depth = kNotThere;
}

}  // namespace postchain::inverse_warp::reference
