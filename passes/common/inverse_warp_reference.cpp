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
#include "passes/common/lens_points.h"

namespace postchain::inverse_warp {
namespace {

constexpr double kAcceptPx = 0.75;
constexpr double kNearer = 1.02;
constexpr double kOneDepth = 1.05;
constexpr double kAlikePx = 1;
constexpr int kSteps = 2;
constexpr int kHalvings = 2;
constexpr double kSharpening = 2;
constexpr int kLeastTimes = 5;
constexpr double kBright = 2;
constexpr double kSoftPx = 4;

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

// One instant, u in [-1, 1], and one point of the lens.
struct Sample {
    double u = 0;
    Vec lens;
};

// Without a shutter a and b are 0, without a lens the radius is.
struct Surface {
    Vec a, b;
    double straight = 0;
    double inverse_depth = 0;
    double radius = 0;
    bool edge = false;

    double path() const { return std::max(length(a + b), length(a - b)); }
    double squared() const { return dot(a, a) + dot(b, b) + radius * radius; }
    // Displacement in pixels; h: half the open time.
    Vec at(const Sample& sample, double h) const {
        const double u = sample.u;
        const double bend = straight * std::abs(u) + (1 - straight) * std::min(h, 1.0) * u * u;
        return u * a + bend * b + radius * sample.lens;
    }
};
double apart(const Surface& a, const Surface& b) {
    const Vec da = a.a - b.a, db = a.b - b.b;
    return dot(da, da) + dot(db, db) + (a.radius - b.radius) * (a.radius - b.radius);
}

bool finite(const double* rgba) {
    return std::all_of(rgba, rgba + 4, [](double x) { return std::isfinite(x); });
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

class Warp {
  public:
    Warp(const PlanContext& context, const Settings& settings, ReferenceFrame& frame)
        : s_(settings),
          description_(context.frame),
          frame_(frame),
          width_(context.frame.width),
          height_(context.frame.height),
          columns_((width_ + kBlockPx - 1) / kBlockPx),
          rows_((height_ + kBlockPx - 1) / kBlockPx),
          half_open_(settings.shutter ? settings.shutter->half_open : 1),
          noise_(noise::table(settings.noise, context.frame.frame_number)),
          depth_(frame.planes.at(Role::inverse_depth)),
          hint_wanted_(context.wanted.has(Role::hint)) {
        if (settings.shutter) {
            forward_ = &frame.planes.at(Role::motion);
            if (context.available.has(Role::motion_back))
                back_ = &frame.planes.at(Role::motion_back);
        }
        if (settings.lens) points_ = lens::lens_points(settings.lens->aperture, settings.samples);
    }

    void run() {
        surfaces_.resize(size_t(width_) * size_t(height_));
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) surfaces_[index(x, y)] = surface(x, y);
        tiles_.resize(size_t(columns_ * rows_));
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) pick_surfaces(i, j);
        for (int j = 0; j < rows_; ++j)
            for (int i = 0; i < columns_; ++i) pick_starts(i, j);
        const bool shares = s_.lens && s_.lens->share_highlights;
        ImageD color(width_, height_, 4), excess(width_, height_, 4);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x)
                expose(x, y, shares ? light_of_tile(x / kBlockPx, y / kBlockPx) : -1,
                       color.pixel(x, y), excess.pixel(x, y));
        if (shares) {
            frame_.stages["gathered"] = color;
            frame_.stages["excess"] = excess;
            share(excess, color);
        }
        frame_.stages["color"] = color;
        frame_.planes[Role::color] = std::move(color);
        make_hint();
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
        if (!forward_) return m;
        m.forward = {forward_->at(x, y, 0), forward_->at(x, y, 1)};
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
        s.a = 0.5 * half_open_ * (chosen.forward + chosen.back);
        s.b = 0.5 * half_open_ * (chosen.forward - chosen.back);
        // |b|/|a| from 0.8 to 1.2.
        const double ratio = dot(s.b, s.b) / std::max(dot(s.a, s.a), 1e-6);
        const double t = std::clamp((ratio - 0.64) / (1.44 - 0.64), 0.0, 1.0);
        s.straight = t * t * (3 - 2 * t);
        const double max_path = s_.shutter ? s_.shutter->max_path_px : 0;
        if (const double path = s.path(); path > max_path) {
            s.a = max_path / path * s.a;
            s.b = max_path / path * s.b;
        }
        s = stored(s);
        if (s_.lens) s.radius = s_.lens->coc.radius_px(s.inverse_depth);
        return s;
    }

    // The three surfaces of a tile that are displaced most differently.
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

    // Surfaces that can be displaced into this tile, in row order.
    std::vector<Surface> meeting(int i, int j) {
        std::vector<Surface> found;
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x)
                for (const Surface& s : tile(x, y).surfaces) {
                    const double aside = 0.1 * length(s.a) + 1.1 * std::abs(s.radius) + 1;
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
        for (const Surface& s : candidates)
            t.longest = std::max(t.longest, s.path() + std::abs(s.radius));
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

    // Mean of the largest components.
    double light_of_tile(int i, int j) const {
        const ImageD& color = frame_.planes.at(Role::color);
        double sum = 0;
        int count = 0;
        for (int y = j * kBlockPx; y < std::min((j + 1) * kBlockPx, height_); ++y)
            for (int x = i * kBlockPx; x < std::min((i + 1) * kBlockPx, width_); ++x, ++count) {
                const double* c = color.pixel(x, y);
                const double largest = std::max({c[0], c[1], c[2]});
                if (std::isfinite(largest)) sum += std::clamp(largest, 0.0, 1e30);
            }
        return sum / count;
    }

    // Sample k of n. The points of the lens go outward, so the times beside them go by digits
    // mirrored at the point.
    Sample sample(int x, int y, int k, int n) const {
        const bool random = !noise_.data.empty();
        const double turn = random ? noise_.at(x % noise_.width, y % noise_.height, 0) : 0;
        const double shift = random ? noise_.at(x % noise_.width, y % noise_.height, 1) : 0;
        Sample sample;
        if (s_.lens) {
            const int set = std::min(int(turn * points_.sets), points_.sets - 1);
            const auto point = points_.at(k, set);
            sample.lens = {point[0], point[1]};
        }
        if (!s_.shutter) return sample;
        if (!s_.lens) {
            sample.u = 2 * (k + 0.5 + 0.5 * s_.shutter->time_jitter * shift) / n - 1;
            return sample;
        }
        double mirrored = 0, place = 0.5;
        for (int rest = k; rest > 0; rest /= 2, place /= 2) mirrored += place * (rest % 2);
        const double turns = mirrored + 0.5 / n + 0.5 + 0.5 * shift;
        sample.u = 2 * (turns - std::floor(turns)) - 1;
        return sample;
    }

    // A ray through this point of the lens comes from the place where the pixel sees infinity. The
    // barrel's circle is moved against it, by cats_eye where it is a corner of the picture.
    bool passes_barrel(Vec p, Vec point) const {
        if (!s_.lens || s_.lens->aperture.cats_eye == 0) return true;
        const Vec display = {double(description_.display_width),
                             double(description_.display_height)};
        const Vec origin = {double(description_.origin_x), double(description_.origin_y)};
        const Vec from = p - s_.lens->coc.radius_px(0) * point;
        const Vec place = from + origin + Vec{0.5, 0.5} - 0.5 * display;
        return length(point + s_.lens->aperture.cats_eye / (0.5 * length(display)) * place) <= 1;
    }

    // `light`: of the pixel's tile; < 0: highlights are not told apart.
    void expose(int x, int y, double light, double* out, double* excess) {
        const Tile& t = tile(x / kBlockPx, y / kBlockPx);
        const double* own = frame_.planes.at(Role::color).pixel(x, y);
        std::copy(own, own + 4, out);
        moments_.push_back(0);
        if (t.longest <= s_.still_limit_px) return;
        int n = s_.samples;
        if (!s_.lens)
            n = int(std::clamp(std::ceil(2 * t.longest / s_.shutter->path_px_per_time),
                               double(kLeastTimes), double(std::max(n, kLeastTimes))));
        Surface begin = surfaces_[index(x, y)];
        double sum[4] = {0, 0, 0, 0};
        const Vec p = {double(x), double(y)};
        std::vector<Sample> samples;
        for (int k = 0; k < n; ++k)
            if (const Sample one = sample(x, y, k, n); passes_barrel(p, one.lens))
                samples.push_back(one);
        n = int(samples.size());
        for (const Sample& sample : samples) {
            double q = 0;
            const Vec at = seen_at(p, sample, t, begin, q);
            double seen[4];
            for (int c = 0; c < 4; ++c) seen[c] = color_at(at, c);
            moments_.back() += dot(at - p, at - p) / n;
            const bool soft = light >= 0 && std::abs(s_.lens->coc.radius_px(q)) >= kSoftPx;
            const double high = std::max({seen[0], seen[1], seen[2]});
            for (int c = 0; c < 4; ++c) sum[c] += seen[c] - own[c];
            if (!soft) continue;
            excess[3] += 1.0 / n;
            if (high > kBright * light && finite(seen))
                for (int c = 0; c < 3; ++c) excess[c] += (1 - kBright * light / high) * seen[c] / n;
        }
        if (n == 0) return;
        for (int c = 0; c < 4; ++c) out[c] = own[c] + sum[c] / n;
    }

    // Each pixel gets its share of the light in excess around it, within the range of the pixels
    // there.
    void share(const ImageD& excess, ImageD& color) const {
        const ImageD gathered = color;
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                const double* own = excess.pixel(x, y);
                if (!(own[3] > 0) || !finite(gathered.pixel(x, y))) continue;
                double sum[4] = {0, 0, 0, 0}, least[3], most[3];
                for (int c = 0; c < 3; ++c) least[c] = most[c] = gathered.at(x, y, c);
                for (int j = y - 1; j <= y + 1; ++j) {
                    for (int i = x - 1; i <= x + 1; ++i) {
                        const int px = std::clamp(i, 0, width_ - 1);
                        const int py = std::clamp(j, 0, height_ - 1);
                        const double* around = gathered.pixel(px, py);
                        for (int c = 0; c < 4; ++c) sum[c] += excess.at(px, py, c);
                        if (excess.at(px, py, 3) == 0 || !finite(around)) continue;
                        for (int c = 0; c < 3; ++c) {
                            least[c] = std::min(least[c], around[c]);
                            most[c] = std::max(most[c], around[c]);
                        }
                    }
                }
                for (int c = 0; c < 3; ++c)
                    color.at(x, y, c) =
                        std::clamp(gathered.at(x, y, c) - own[c] + own[3] / sum[3] * sum[c],
                                   least[c], most[c]);
            }
        }
    }

    // Of a shutter: 1, and whether the streak's half-length is above 0.5 px. Of the lens alone the
    // hint that there is, less where the pixel itself is out of focus.
    void make_hint() {
        const auto given = frame_.planes.find(Role::hint);
        if (!hint_wanted_ || (!s_.shutter && given == frame_.planes.end())) return;
        ImageD hint(width_, height_, 2);
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                const bool still = tile(x / kBlockPx, y / kBlockPx).longest <= s_.still_limit_px;
                double* out = hint.pixel(x, y);
                if (!s_.shutter) {
                    const double radius = std::abs(surfaces_[index(x, y)].radius);
                    const double kept = still ? 1 : std::clamp(1 - radius, 0.0, 1.0);
                    for (int c = 0; c < 2; ++c) out[c] = kept * given->second.at(x, y, c);
                } else if (!still) {
                    out[0] = 1;
                    out[1] = std::sqrt(3 * moments_[index(x, y)]) > 0.5 ? 1 : 0;
                }
            }
        }
        frame_.stages["hint"] = hint;
        frame_.planes[Role::hint] = std::move(hint);
    }

    // Where in this frame lies what this sample sees at p, and its inverse depth q. Of the shutter
    // alone `begin` becomes what the search from it has found.
    Vec seen_at(Vec p, const Sample& sample, const Tile& t, Surface& begin, double& q) const {
        double nearest = -1, residual = kAcceptPx, farthest = 3.4e38;
        Vec found, far;
        const auto search = [&](Vec d, int steps, Surface* accepted_surface) {
            for (int step = 0; step < steps; ++step) {
                const double x = std::floor(p.x - d.x + 0.5), y = std::floor(p.y - d.y + 0.5);
                const Vec inside = {std::clamp(x, 0.0, width_ - 1.0),
                                    std::clamp(y, 0.0, height_ - 1.0)};
                const Surface& s = surfaces_[index(int(inside.x), int(inside.y))];
                d = s.at(sample, half_open_);
                const Vec to = p - d;
                const double error = std::max(std::abs(x - to.x), std::abs(y - to.y));
                if (s.inverse_depth < farthest) {
                    farthest = s.inverse_depth;
                    far = inside;
                }
                if (error > kAcceptPx) continue;
                if (s.inverse_depth > nearest * kNearer ||
                    (s.inverse_depth * kNearer >= nearest && error < residual)) {
                    nearest = s.inverse_depth;
                    residual = error;
                    found = s.edge ? inside
                                   : Vec{std::clamp(to.x, 0.0, width_ - 1.0),
                                         std::clamp(to.y, 0.0, height_ - 1.0)};
                }
                if (accepted_surface) *accepted_surface = s;
                return;
            }
        };
        search(begin.at(sample, half_open_), s_.shutter ? kSteps : 1, s_.lens ? nullptr : &begin);
        for (const Surface& start : t.starts) {
            if (start.inverse_depth <= nearest * kNearer) break;
            search(start.at(sample, half_open_), kSteps, nullptr);
        }
        q = nearest >= 0 ? nearest : farthest;
        if (nearest >= 0) return found;
        if (s_.lens) return far;
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

    const Settings& s_;
    const FrameDescription& description_;
    ReferenceFrame& frame_;
    int width_, height_, columns_, rows_;
    double half_open_;
    ImageD noise_;
    lens::Points points_;
    const ImageD& depth_;
    const ImageD* forward_ = nullptr;
    const ImageD* back_ = nullptr;
    bool hint_wanted_;
    std::vector<Surface> surfaces_;
    std::vector<Tile> tiles_;
    std::vector<double> moments_;  // of each pixel: mean of the squared displacements, px^2
};

}  // namespace

void warp_reference(const PlanContext& context, const Settings& settings, ReferenceFrame& frame) {
    Warp(context, settings, frame).run();
}

}  // namespace postchain::inverse_warp
