// Written from the definitions of docs/inverse_warp.md, one pixel at a time; the GLSL shares
// nothing with it but the random numbers and what storage rounds.
#include "passes/common/inverse_warp_reference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "chain/work_list.h"

namespace postchain::inverse_warp {
namespace {

constexpr double kAcceptPx = 0.75;
constexpr double kNearer = 1.02;
constexpr double kOneDepth = 1.05;
constexpr double kAlikePx = 1;
constexpr int kSteps = 2;
constexpr int kHalvings = 2;
constexpr double kSharpening = 2;

struct Vec {
    double x = 0, y = 0;
};
Vec operator+(Vec a, Vec b) {
    return {a.x + b.x, a.y + b.y};
}
Vec operator-(Vec a, Vec b) {
    return {a.x - b.x, a.y - b.y};
}
Vec operator*(double s, Vec v) {
    return {s * v.x, s * v.y};
}
double dot(Vec a, Vec b) {
    return a.x * b.x + a.y * b.y;
}
double length(Vec v) {
    return std::sqrt(dot(v, v));
}

// Forward and backward motion of a pixel, px per frame.
struct Motion {
    Vec forward, back;
};
double apart(const Motion& a, const Motion& b) {
    const Vec f = a.forward - b.forward, k = a.back - b.back;
    return dot(f, f) + dot(k, k);
}

struct Surface {
    Vec a, b;
    double straight = 0;
    double inverse_depth = 0;
    bool edge = false;

    double path() const { return std::max(length(a + b), length(a - b)); }
    double squared() const { return dot(a, a) + dot(b, b); }
    // Position in pixels relative to the frame's own, at time u; h: half the open time.
    Vec at(double u, double h) const {
        const double bend = straight * std::abs(u) + (1 - straight) * std::min(h, 1.0) * u * u;
        return u * a + bend * b;
    }
};
double apart(const Surface& a, const Surface& b) {
    const Vec da = a.a - b.a, db = a.b - b.b;
    return dot(da, da) + dot(db, db);
}

bool one_depth(double q, double r) {
    return q <= kOneDepth * r && r <= kOneDepth * q;
}

// As the texture of surfaces holds it: a in 32 bits, b in steps of 1/64 px, the inverse depth
// without its last 8 bits, w in 7 bits.
Surface stored(Surface s) {
    const auto single = [](double x) { return double(float(x)); };
    const auto step = [](double x) {
        return std::clamp(std::floor(float(x) * 64 + 0.5), -32767.0, 32767.0) / 64;
    };
    s.a = {single(s.a.x), single(s.a.y)};
    s.b = {step(s.b.x), step(s.b.y)};
    s.straight = std::floor(s.straight * 127 + 0.5) / 127;
    const auto bits = std::bit_cast<uint32_t>(float(s.inverse_depth)) & 0xffffff00u;
    s.inverse_depth = std::bit_cast<float>(bits);
    return s;
}

struct Tile {
    std::array<Surface, 3> surfaces;
    std::vector<Surface> starts;
    double longest = 0;
};

class Shutter {
  public:
    Shutter(const PlanContext& context, const ShutterSettings& settings, const ImageD* noise,
            ReferenceFrame& frame)
        : s_(settings),
          noise_(noise),
          frame_(frame),
          width_(context.frame.width),
          height_(context.frame.height),
          columns_((width_ + kBlockPx - 1) / kBlockPx),
          rows_((height_ + kBlockPx - 1) / kBlockPx),
          ring_(int(std::ceil(settings.max_path_px * 1.1 / kBlockPx)) + 1),
          depth_(frame.planes.at(Role::inverse_depth)),
          forward_(frame.planes.at(Role::motion)),
          back_(context.available.has(Role::motion_back) ? &frame.planes.at(Role::motion_back)
                                                         : nullptr),
          hint_wanted_(context.wanted.has(Role::hint)) {}

    void run() {
        surfaces_.resize(size_t(width_) * size_t(height_));
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) surfaces_[index(x, y)] = surface(x, y);
        tiles_.resize(size_t(columns_ * rows_));
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) pick_surfaces(i, j);
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) pick_starts(i, j);
        ImageD color(width_, height_, 4), hint(width_, height_, 2);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) expose(x, y, color.pixel(x, y), hint.pixel(x, y));
        frame_.stages["color"] = color;
        frame_.planes[Role::color] = std::move(color);
        if (!hint_wanted_) return;
        frame_.stages["hint"] = hint;
        frame_.planes[Role::hint] = std::move(hint);
    }

  private:
    size_t index(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    Tile& tile(int i, int j) { return tiles_[size_t(j * columns_ + i)]; }

    double depth(int x, int y) const {
        const double q = depth_.at(x, y);
        return q > 0 ? std::min(q, 3e38) : 0;
    }
    Motion motion(int x, int y) const {
        Motion m;
        m.forward = {forward_.at(x, y, 0), forward_.at(x, y, 1)};
        m.back = back_ ? Vec{back_->at(x, y, 0), back_->at(x, y, 1)} : m.forward;
        for (double* v : {&m.forward.x, &m.forward.y, &m.back.x, &m.back.y}) {
            if (!std::isfinite(*v)) return {};
            *v = std::clamp(*v, -1e15, 1e15);
        }
        return m;
    }

    Surface surface(int x, int y) const {
        Surface s;
        s.inverse_depth = depth(x, y);
        const Motion own = motion(x, y);
        // Left, right, up, down: as many as lie on another surface.
        std::array<Motion, 4> around;
        std::array<bool, 4> same;
        Motion other;
        int count = 0;
        const std::array<std::array<int, 2>, 4> steps = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
        for (size_t i = 0; i < 4; ++i) {
            const int nx = std::clamp(x + steps[i][0], 0, width_ - 1);
            const int ny = std::clamp(y + steps[i][1], 0, height_ - 1);
            around[i] = motion(nx, ny);
            same[i] = one_depth(s.inverse_depth, depth(nx, ny));
            if (same[i]) continue;
            other.forward = other.forward + around[i].forward;
            other.back = other.back + around[i].back;
            ++count;
        }
        Motion chosen = own;
        if (count > 0) {
            s.edge = true;
            other.forward = 1.0 / count * other.forward;
            other.back = 1.0 / count * other.back;
            for (size_t i = 0; i < 4; ++i)
                if (same[i] && apart(around[i], other) > apart(chosen, other)) chosen = around[i];
        }
        s.a = 0.5 * s_.half_shutter * (chosen.forward + chosen.back);
        s.b = 0.5 * s_.half_shutter * (chosen.forward - chosen.back);
        // |b|/|a| from 0.8 to 1.2.
        const double ratio = dot(s.b, s.b) / std::max(dot(s.a, s.a), 1e-6);
        const double t = std::clamp((ratio - 0.64) / (1.44 - 0.64), 0.0, 1.0);
        s.straight = t * t * (3 - 2 * t);
        if (const double path = s.path(); path > s_.max_path_px) {
            s.a = s_.max_path_px / path * s.a;
            s.b = s_.max_path_px / path * s.b;
        }
        return stored(s);
    }

    // The three surfaces of a tile that move most differently.
    void pick_surfaces(int i, int j) {
        Tile& t = tile(i, j);
        const auto farthest = [&](const auto& measure) {
            double most = -1;
            Surface best;
            for (int y = j * kBlockPx; y < std::min((j + 1) * kBlockPx, height_); ++y)
                for (int x = i * kBlockPx; x < std::min((i + 1) * kBlockPx, width_); ++x)
                    if (const double m = measure(surfaces_[index(x, y)]); m > most) {
                        most = m;
                        best = surfaces_[index(x, y)];
                    }
            return best;
        };
        t.surfaces[0] = farthest([&](const Surface& s) { return s.squared(); });
        t.surfaces[1] = farthest([&](const Surface& s) { return apart(s, t.surfaces[0]); });
        t.surfaces[2] = farthest([&](const Surface& s) {
            return std::min(apart(s, t.surfaces[0]), apart(s, t.surfaces[1]));
        });
    }

    // Surfaces of the tiles around whose paths meet this tile, in row order.
    std::vector<Surface> meeting(int i, int j) {
        std::vector<Surface> found;
        for (int y = std::max(j - ring_, 0); y <= std::min(j + ring_, rows_ - 1); ++y)
            for (int x = std::max(i - ring_, 0); x <= std::min(i + ring_, columns_ - 1); ++x)
                for (const Surface& s : tile(x, y).surfaces) {
                    const double aside = 0.1 * length(s.a) + 1;
                    const int gap_x = std::max(std::abs(x - i) - 1, 0) * kBlockPx;
                    const int gap_y = std::max(std::abs(y - j) - 1, 0) * kBlockPx;
                    if (std::abs(s.a.x) + std::abs(s.b.x) + aside >= gap_x &&
                        std::abs(s.a.y) + std::abs(s.b.y) + aside >= gap_y)
                        found.push_back(s);
                }
        return found;
    }

    void pick_starts(int i, int j) {
        Tile& t = tile(i, j);
        const std::vector<Surface> candidates = meeting(i, j);
        for (const Surface& s : candidates) t.longest = std::max(t.longest, s.path());
        for (int k = 0; k < s_.starts; ++k) {
            double most = kAlikePx * kAlikePx;
            const Surface* next = nullptr;
            for (const Surface& s : candidates) {
                double least = k == 0 ? s.squared() + 2 * kAlikePx * kAlikePx : 3e38;
                for (const Surface& chosen : t.starts) least = std::min(least, apart(s, chosen));
                if (least > most) {
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

    // Linear weights steepened about their middle.
    double color_at(Vec at, int channel) const {
        const ImageD& color = frame_.planes.at(Role::color);
        const auto steep = [](double f) {
            return std::clamp(kSharpening * (f - 0.5) + 0.5, 0.0, 1.0);
        };
        const double fx = steep(at.x - std::floor(at.x)), fy = steep(at.y - std::floor(at.y));
        const int x0 = int(std::floor(at.x)), y0 = int(std::floor(at.y));
        const int x1 = std::min(x0 + 1, width_ - 1), y1 = std::min(y0 + 1, height_ - 1);
        const auto c = [&](int x, int y) { return color.at(x, y, channel); };
        return (1 - fy) * ((1 - fx) * c(x0, y0) + fx * c(x1, y0)) +
               fy * ((1 - fx) * c(x0, y1) + fx * c(x1, y1));
    }

    void expose(int x, int y, double* out, double* hint) {
        const Tile& t = tile(x / kBlockPx, y / kBlockPx);
        const double* own = frame_.planes.at(Role::color).pixel(x, y);
        std::copy(own, own + 4, out);
        if (t.longest <= s_.still_limit_px) return;
        const int most = std::max(s_.samples, kLeastTimes);
        const int times = int(std::clamp(std::ceil(2 * t.longest / s_.path_px_per_time),
                                         double(kLeastTimes), double(most)));
        const double j = noise_ ? noise_->at(x % noise_->width, y % noise_->height, 1) : 0;
        const double shift = 0.5 + 0.5 * s_.time_jitter * j;
        Surface begin = surfaces_[index(x, y)];
        double sum[4] = {0, 0, 0, 0}, moment = 0;
        for (int k = 0; k < times; ++k) {
            const double u = 2 * (k + shift) / times - 1;
            const Vec at = seen_at({double(x), double(y)}, u, t, begin);
            for (int c = 0; c < 4; ++c) sum[c] += color_at(at, c) - own[c];
            moment += dot(at - Vec{double(x), double(y)}, at - Vec{double(x), double(y)});
        }
        for (int c = 0; c < 4; ++c) out[c] = own[c] + sum[c] / times;
        hint[0] = 1;
        hint[1] = std::sqrt(3 * moment / times) > 0.5 ? 1 : 0;
    }

    // Where in this frame lies what was seen at p at time u. `begin` starts the search and becomes
    // what the search from it has found.
    Vec seen_at(Vec p, double u, const Tile& t, Surface& begin) const {
        double nearest = -1, residual = kAcceptPx, farthest = 3.4e38;
        Vec found, far;
        const auto search = [&](Vec d, Surface* accepted_surface) {
            for (int step = 0; step < kSteps; ++step) {
                const double x = std::floor(p.x - d.x + 0.5), y = std::floor(p.y - d.y + 0.5);
                const Vec inside = {std::clamp(x, 0.0, width_ - 1.0),
                                    std::clamp(y, 0.0, height_ - 1.0)};
                const Surface& s = surfaces_[index(int(inside.x), int(inside.y))];
                d = s.at(u, s_.half_shutter);
                const Vec to = p - d;
                const double error = std::max(std::abs(x - to.x), std::abs(y - to.y));
                const double q = s.inverse_depth;
                if (q < farthest) {
                    farthest = q;
                    far = inside;
                }
                if (error > kAcceptPx) continue;
                if (q > nearest * kNearer || (q * kNearer >= nearest && error < residual)) {
                    nearest = q;
                    residual = error;
                    found = s.edge ? inside
                                   : Vec{std::clamp(to.x, 0.0, width_ - 1.0),
                                         std::clamp(to.y, 0.0, height_ - 1.0)};
                }
                if (accepted_surface) *accepted_surface = s;
                return;
            }
        };
        search(begin.at(u, s_.half_shutter), &begin);
        for (const Surface& start : t.starts) {
            if (start.inverse_depth <= nearest * kNearer) break;
            search(start.at(u, s_.half_shutter), nullptr);
        }
        if (nearest >= 0) return found;
        // Hidden in this frame: the background nearest to p on the way to the farthest surface met.
        Vec from = p;
        for (int i = 0; i < kHalvings; ++i) {
            const int x = int(std::floor(0.5 * (from.x + far.x) + 0.5));
            const int y = int(std::floor(0.5 * (from.y + far.y) + 0.5));
            Vec& end = surfaces_[index(x, y)].inverse_depth <= kOneDepth * farthest ? far : from;
            end = {double(x), double(y)};
        }
        return far;
    }

    const ShutterSettings& s_;
    const ImageD* noise_;
    ReferenceFrame& frame_;
    int width_, height_, columns_, rows_, ring_;
    const ImageD& depth_;
    const ImageD& forward_;
    const ImageD* back_;
    bool hint_wanted_;
    std::vector<Surface> surfaces_;
    std::vector<Tile> tiles_;
};

}  // namespace

void shutter_reference(const PlanContext& context, const ShutterSettings& settings,
                       const ImageD* noise, ReferenceFrame& frame) {
    Shutter(context, settings, noise, frame).run();
}

}  // namespace postchain::inverse_warp
