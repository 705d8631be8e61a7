#include "passes/inverse_warp/reference_surfaces.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "chain/frame/convert.h"
#include "chain/pass/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr std::array<std::array<int, 2>, 4> kAround = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

// Forward and backward motion of a pixel, px per frame.
struct Motion {
    Vec forward, back;
};
double apart(const Motion& a, const Motion& b) {
    const Vec f = a.forward - b.forward, k = a.back - b.back;
    return dot(f, f) + dot(k, k);
}

// x as a float with these last bits.
double with_last(int bits, double x, uint32_t last) {
    return double(std::bit_cast<float>(std::bit_cast<uint32_t>(float(x)) >> bits << bits | last));
}
double without_last(int bits, double x) {
    return with_last(bits, x, 0);
}

// mixture.glsl: the places of colors and the part in front are stored in last bits of a, which
// nothing takes out.
uint32_t place_of(Vec offset) {
    return uint32_t((offset.y + 2) * 5 + offset.x + 2);
}
Surface with_place(Surface surface, Vec color_from) {
    surface.edge = true;
    surface.color_from = color_from;
    surface.a = {with_last(8, surface.a.x, place_of(color_from) << 3),
                 with_last(8, surface.a.y, place_of({}) << 3)};
    return surface;
}
Surface with_front(Surface surface, Vec color_from, Vec front_from, double part) {
    const uint32_t parts = uint32_t(63 * part + 0.5);
    surface.edge = true;
    surface.color_from = color_from;
    surface.front_from = front_from;
    surface.front_part = parts / 63.0;
    surface.a = {with_last(11, surface.a.x, parts >> 3 << 8 | place_of(color_from) << 3),
                 with_last(11, surface.a.y, (parts & 7) << 8 | place_of(front_from) << 3)};
    return surface;
}

Surface stored(Surface s) {
    const auto step = [](double x) {
        return std::clamp(std::floor(float(x) * 64 + 0.5), -32767.0, 32767.0) / 64;
    };
    s.a = {without_last(3, s.a.x), without_last(3, s.a.y)};
    s.b = {step(s.b.x), step(s.b.y)};
    s.straight = std::floor(s.straight * 63 + 0.5) / 63;
    s.inverse_depth = without_last(2, s.inverse_depth);
    return s;
}

double smoothstep(double from, double to, double x) {
    const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

// surfaces.comp
class PlaneSurfaces {
  public:
    PlaneSurfaces(const Planes& planes, const Settings& settings)
        : planes_(planes),
          settings_(settings),
          width_(planes.inverse_depth->width),
          height_(planes.inverse_depth->height) {}

    std::vector<Surface> all() const {
        std::vector<Surface> surfaces;
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) surfaces.push_back(surface_at(x, y));
        return surfaces;
    }

  private:
    Surface surface_at(int x, int y) const {
        Surface s;
        s.inverse_depth = depth_at(x, y);
        const Motion chosen = own_motion(x, y, s.edge);
        const double h = half_open_of(settings_);
        s.a = 0.5 * h * (chosen.forward + chosen.back);
        s.b = 0.5 * h * (chosen.forward - chosen.back);
        const double ratio = dot(s.b, s.b) / std::max(dot(s.a, s.a), 1e-6);
        s.straight = smoothstep(kBent, kTurned, ratio);
        if (s.straight > 0) s.straight *= bounce_of(x, y, chosen, ratio);
        if (settings_.shutter) {
            const double longest = settings_.shutter->max_path_px;
            if (const double path = s.path(); path > longest) {
                s.a = longest / path * s.a;
                s.b = longest / path * s.b;
            }
        }
        s = stored(s);
        if (settings_.lens) s.radius = settings_.lens->coc.radius_px(s.inverse_depth);
        return s;
    }

    // 1: the pixel's surface bounces, 0: it turns, as everything does in a frame without neighbors.
    // A surface that turns accelerates in the frames before or after too.
    double bounce_of(int x, int y, const Motion& own, double ratio) const {
        const Vec here = own.forward - own.back;
        std::optional<double> bounce;
        for (const bool after : {false, true}) {
            const Planes::Turns& planes = after ? planes_.after : planes_.before;
            if (!planes.motion || !planes.motion_back) continue;
            double by_neighbor = smoothstep(kBentUnseen, kTurnedUnseen, ratio);
            if (const auto there = acceleration_beside(planes, x, y, own, after)) {
                const double squared = std::max(dot(here, here), 1e-6);
                const double along = std::max(dot(*there, here) / squared, 0.0);
                const double across = std::abs(there->x * here.y - there->y * here.x) / squared;
                by_neighbor = std::min(1 - smoothstep(kBounce, kTurn, along),
                                       1 - smoothstep(kBounceAcross, kTurnAcross, across));
            }
            bounce = std::min(bounce.value_or(1), by_neighbor);
        }
        return bounce.value_or(0);
    }

    // In the frame before or after, at the pixel where the surface comes from or goes or, if that
    // shows another one, at the adjacent one that fits best. Another surface has another motion
    // between the frames.
    std::optional<Vec> acceleration_beside(const Planes::Turns& planes, int x, int y,
                                           const Motion& own, bool after) const {
        const Vec p = {double(x), double(y)}, between = after ? own.forward : own.back;
        const Vec at = after ? p + between : p - between;
        const double i = std::floor(at.x + 0.5), j = std::floor(at.y + 0.5);
        if (!(i >= 0 && j >= 0 && i < width_ && j < height_)) return std::nullopt;
        double least =
            kOtherMotionPx * kOtherMotionPx + kOtherMotion * kOtherMotion * dot(between, between);
        std::optional<Vec> found;
        const auto look_at = [&](int column, int row) {
            const int cx = std::clamp(column, 0, width_ - 1), cy = std::clamp(row, 0, height_ - 1);
            const auto vector = [&](const ImageD& plane) {
                return Vec{plane.at(cx, cy, 0), plane.at(cx, cy, 1)};
            };
            const Vec m = vector(*planes.motion), k = vector(*planes.motion_back);
            const Vec other = (after ? k : m) - between;
            if (!std::isfinite(m.x + m.y + k.x + k.y) || dot(other, other) > least) return;
            least = dot(other, other);
            found = m - k;
        };
        look_at(int(i), int(j));
        if (found) return found;
        for (const auto& [dx, dy] : kAround) look_at(int(i) + dx, int(j) + dy);
        return found;
    }

    double depth_at(int x, int y) const {
        const double q = planes_.inverse_depth->at(x, y);
        if (planes_.may_lack && q < 0) return kNotThere;
        return q > 0 ? std::min(q, 3e38) : 0;
    }

    Motion motion_at(int x, int y) const {
        Motion m;
        if (!planes_.motion) return m;
        const auto at = [&](const ImageD& plane) {
            return Vec{plane.at(x, y, 0), plane.at(x, y, 1)};
        };
        m.forward = at(*planes_.motion);
        m.back = planes_.motion_back ? at(*planes_.motion_back) : m.forward;
        for (double* v : {&m.forward.x, &m.forward.y, &m.back.x, &m.back.y}) {
            if (!std::isfinite(*v)) return {};
            *v = std::clamp(*v, -1e15, 1e15);
        }
        return m;
    }

    // At a depth edge: of the pixel and the adjacent pixels of its surface, the motion that differs
    // most from the other surface's.
    Motion own_motion(int x, int y, bool& edge) const {
        Motion chosen = motion_at(x, y);
        std::array<Motion, 4> around;
        std::array<bool, 4> same;
        Motion other;
        int count = 0;
        for (size_t i = 0; i < 4; ++i) {
            const int nx = std::clamp(x + kAround[i][0], 0, width_ - 1);
            const int ny = std::clamp(y + kAround[i][1], 0, height_ - 1);
            around[i] = motion_at(nx, ny);
            same[i] = one_depth(depth_at(x, y), depth_at(nx, ny));
            if (same[i]) continue;
            other.forward = other.forward + around[i].forward;
            other.back = other.back + around[i].back;
            ++count;
        }
        edge = count > 0;
        if (!edge) return chosen;
        other.forward = 1.0 / count * other.forward;
        other.back = 1.0 / count * other.back;
        for (size_t i = 0; i < 4; ++i)
            if (same[i] && apart(around[i], other) > apart(chosen, other)) chosen = around[i];
        return chosen;
    }

    const Planes& planes_;
    const Settings& settings_;
    int width_, height_;
};

// Difference between the paths of two surfaces, px^2.
double apart_by_motion(const Surface& s, const Surface& t) {
    const Vec a = s.a - t.a, b = s.b - t.b;
    return dot(a, a) + dot(b, b);
}

// Do the displacements of two surfaces differ by more than px of motion, or kLensPartPx of radius?
bool part(const Surface& s, const Surface& t, double px, const Settings& settings) {
    return (settings.shutter && apart_by_motion(s, t) > px * px) ||
           std::abs(s.radius - t.radius) > kLensPartPx;
}

// Does a surface leave its place so far?
bool leaves(const Surface& s, double px, const Settings& settings) {
    return (settings.shutter && s.path() > px) || std::abs(s.radius) > kLensPartPx;
}

// mixed_pixels.comp, split_pixels.comp
class MixedPixels {
    using Offset = std::pair<int, int>;

  public:
    MixedPixels(const ImageD& color, const ImageD* motion, const std::vector<Surface>& surfaces,
                const Settings& settings, Split split)
        : color_(color), motion_(motion), surfaces_(surfaces), settings_(settings), split_(split) {}

    // The surface of pixel x, y, at an edge.
    Surface split(int x, int y) const {
        const Surface& own = surface(x, y);
        const double* c = color_.pixel(x, y);
        // Pixels away from edges, nearest first, and the nearest one of another surface at an edge.
        std::vector<Offset> same, others;
        std::optional<double> mixed_depth;
        for (const Offset& at : kAround5) {
            if (!inside(x + at.first, y + at.second)) continue;
            const Surface& s = surface(x + at.first, y + at.second);
            const bool is_same = one_depth(s.inverse_depth, own.inverse_depth);
            if (s.edge && !is_same && !mixed_depth) mixed_depth = s.inverse_depth;
            if (s.edge) continue;
            if (is_same) same.push_back(at);
            if (!is_same &&
                (others.empty() || one_depth(s.inverse_depth, depth(x, y, others.front()))))
                others.push_back(at);
        }
        const bool thin = others.empty();
        if (same.empty() || (thin && !mixed_depth)) return own;
        const double other_depth = thin ? *mixed_depth : depth(x, y, others.front());
        const bool in_front = other_depth <= own.inverse_depth;
        if (!thin) {
            const Offset mine = closest(x, y, same, c), theirs = closest(x, y, others, c);
            const Offset to_front = in_front ? mine : theirs, to_back = in_front ? theirs : mine;
            if (const double part = part_in_front(x, y, to_front, to_back); part > 0)
                return with_front(surface(x + to_back.first, y + to_back.second), vec(to_back),
                                  vec(to_front), part);
        }
        if (in_front) {  // the outline of the one in front
            if (thin) return own;
            const Offset mine = closest(x, y, same, c), theirs = closest(x, y, others, c);
            const Surface& front = surface(x + mine.first, y + mine.second);
            const Surface& back = surface(x + theirs.first, y + theirs.second);
            return mixes_motion(own, front, back) ? with_place(front, {}) : own;
        }
        Offset mine, theirs;
        if (thin) {
            // The one in front shows nowhere alone: its color is the one that goes farthest from
            // that behind.
            const std::array<double, 3> mean = mean_of(x, y, same);
            const auto front = farthest(x, y, other_depth, mean);
            if (!front) return own;
            mine = closest(x, y, same, mean.data());
            theirs = *front;
        } else {
            mine = closest(x, y, same, c);
            theirs = closest(x, y, others, c);
        }
        const auto share = share_of(c, pixel(x, y, mine), pixel(x, y, theirs));
        const Surface& front = surface(x + theirs.first, y + theirs.second);
        const Surface& back = surface(x + mine.first, y + mine.second);
        if (!share || !part(back, front, kPartPx, settings_)) return own;
        if (*share < (thin ? kLeastShareThin : kLeastShare) || *share > kMostShare) return own;
        if (*share < most_own(front, back)) return with_place(front, {});
        return split_ == Split::in_front ? own : with_place(own, vec(mine));
    }

  private:
    // Offsets to the pixels of the square of 5 x 5 around, in the order in which equals are
    // preferred.
    static constexpr std::array<Offset, 24> kAround5 = {
        {{-1, 0},  {1, 0},  {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1},
         {-2, 0},  {2, 0},  {0, -2}, {0, 2}, {-2, -1}, {2, -1}, {-2, 1}, {2, 1},
         {-1, -2}, {1, -2}, {-1, 2}, {1, 2}, {-2, -2}, {2, -2}, {-2, 2}, {2, 2}}};

    static Vec vec(Offset at) { return {double(at.first), double(at.second)}; }
    // The part of the surface in front, if it stays in place and the one behind leaves, by the
    // pixel's average of both motions; 0: it is none.
    double part_in_front(int x, int y, Offset to_front, Offset to_back) const {
        if (!settings_.shutter) return 0;
        const Surface& front = surface(x + to_front.first, y + to_front.second);
        const Surface& back = surface(x + to_back.first, y + to_back.second);
        if (longest(front, settings_) > kPartPx ||
            apart_by_motion(front, back) <= kPartPx * kPartPx)
            return 0;
        const auto motion = [&](Offset at) {
            const double* v = motion_->pixel(x + at.first, y + at.second);
            if (!std::isfinite(v[0] + v[1])) return Vec{};
            return Vec{std::clamp(v[0], -1e15, 1e15), std::clamp(v[1], -1e15, 1e15)};
        };
        const Vec own = motion({0, 0}) - motion(to_back), way = motion(to_front) - motion(to_back);
        const double part = dot(own, way) / std::max(dot(way, way), 1e-30);
        return std::min(part, 1 - part) >= kLeastPart ? part : 0;
    }
    // A pixel with less of its own surface shows the one in front.
    double most_own(const Surface& front, const Surface& back) const {
        if (std::abs(front.radius) > kLensPartPx) return kMostLeaving;
        if (!settings_.shutter) return kMostStillLens;
        const double px = std::sqrt(apart(front, back, settings_));
        const double slow = std::clamp((kFastPx - px) / kSlowerPx, 0.0, 1.0);
        const double most = kMostLeaving * (1 - slow) + kMostSlow * slow;
        return front.path() > kPartPx ? most : std::max(most, kMostStill);
    }
    // Does an outline's pixel move as a mixture of its own surface and of the one behind?
    bool mixes_motion(const Surface& own, const Surface& front, const Surface& back) const {
        const double between = apart_by_motion(front, back);
        return settings_.shutter && between > kPartPx * kPartPx &&
               apart_by_motion(own, front) > kRest * kRest * between;
    }

    bool inside(int x, int y) const {
        return x >= 0 && y >= 0 && x < color_.width && y < color_.height;
    }
    const Surface& surface(int x, int y) const {
        return surfaces_[size_t(y) * size_t(color_.width) + size_t(x)];
    }
    double depth(int x, int y, Offset at) const {
        return surface(x + at.first, y + at.second).inverse_depth;
    }
    const double* pixel(int x, int y, Offset at) const {
        return color_.pixel(x + at.first, y + at.second);
    }
    static double difference(const double* a, const double* b) {
        double sum = 0;
        for (size_t c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
        return sum;
    }
    std::array<double, 3> mean_of(int x, int y, const std::vector<Offset>& places) const {
        std::array<double, 3> mean = {};
        for (const Offset& at : places)
            for (size_t c = 0; c < 3; ++c) mean[c] += pixel(x, y, at)[c] / double(places.size());
        return mean;
    }
    // The place with the closest color among the nearest ones.
    Offset closest(int x, int y, const std::vector<Offset>& places, const double* rgb) const {
        const auto squared = [](Offset at) { return at.first * at.first + at.second * at.second; };
        Offset best = places.front();
        for (const Offset& at : places)
            if (squared(at) <= squared(places.front()) + kSlackPx2 &&
                difference(pixel(x, y, at), rgb) < difference(pixel(x, y, best), rgb))
                best = at;
        return best;
    }
    // The adjacent place that has this depth and lies farthest from `mean` on the way to the
    // pixel's color.
    std::optional<Offset> farthest(int x, int y, double inverse_depth,
                                   const std::array<double, 3>& mean) const {
        std::optional<Offset> best;
        double most = -1;
        for (int k = 0; k < 8; ++k) {
            const Offset at = kAround5[size_t(k)];
            if (!inside(x + at.first, y + at.second) || !one_depth(depth(x, y, at), inverse_depth))
                continue;
            double along = 0;
            for (size_t c = 0; c < 3; ++c)
                along += (pixel(x, y, at)[c] - mean[c]) * (color_.pixel(x, y)[c] - mean[c]);
            if (along <= most) continue;
            most = along;
            best = at;
        }
        return most >= 0 ? best : std::nullopt;
    }
    // The share of the color `mine` in a mixture with `theirs`; none: it is not such a mixture.
    static std::optional<double> share_of(const double* c, const double* mine,
                                          const double* theirs) {
        const std::array<double, 3> black = {};
        const double contrast = difference(mine, theirs);
        if (contrast <=
            kContrast * kContrast *
                std::max(difference(mine, black.data()), difference(theirs, black.data())))
            return std::nullopt;
        double share = 0, rest = 0;
        for (size_t k = 0; k < 3; ++k)
            share += (c[k] - theirs[k]) * (mine[k] - theirs[k]) / contrast;
        for (size_t k = 0; k < 3; ++k) {
            const double off = c[k] - theirs[k] - share * (mine[k] - theirs[k]);
            rest += off * off;
        }
        if (rest > kRest * kRest * contrast) return std::nullopt;
        return share;
    }

    const ImageD& color_;
    const ImageD* const motion_;
    const std::vector<Surface>& surfaces_;
    const Settings& settings_;
    const Split split_;
};

// bright_edges.comp, shown_surfaces.comp
class BrightEdges {
  public:
    BrightEdges(const ImageD& color, const ImageD* motion, std::vector<Surface> surfaces,
                const Settings& settings, Split split)
        : color_(finite_color(color)),
          motion_(motion),
          surfaces_(std::move(surfaces)),
          settings_(settings),
          split_(split) {}

    std::vector<Surface> shown() const {
        std::vector<Surface> result;
        std::vector<char> changed;
        for (int y = 0; y < color_.height; ++y)
            for (int x = 0; x < color_.width; ++x) {
                const auto from = shown_at(x, y);
                changed.push_back(from.has_value());
                const auto [i, j] = from.value_or(Place{x, y});
                result.push_back(surface(i, j));
            }
        // A pixel that has changed is an edge to the pixels around it.
        const std::vector<Surface> inner = result;
        for (int y = 0; y < color_.height; ++y)
            for (int x = 0; x < color_.width; ++x)
                for (const auto& [i, j] : kAround) {
                    if (!inside(x + i, y + j) || !changed[index(x + i, y + j)]) continue;
                    Surface& own = result[index(x, y)];
                    own.edge = own.edge || !one_depth(own.inverse_depth,
                                                      inner[index(x + i, y + j)].inverse_depth);
                }
        if (split_ == Split::none) return result;
        std::vector<Surface> split = result;
        const MixedPixels mixed(color_, motion_, result, settings_, split_);
        for (int y = 0; y < color_.height; ++y)
            for (int x = 0; x < color_.width; ++x) {
                if (!surface(x, y).edge || changed[index(x, y)]) continue;
                const Surface own = mixed.split(x, y);
                split[index(x, y)] = own;
                if (own.front_part > 0) continue;
                // A pixel that takes the surface in front is an edge to the pixels around it.
                for (const auto& [i, j] : kAround)
                    if (inside(x + i, y + j) &&
                        !one_depth(own.inverse_depth, result[index(x + i, y + j)].inverse_depth) &&
                        !result[index(x + i, y + j)].edge) {
                        Surface& beside = split[index(x + i, y + j)];
                        beside = with_place(beside, {});
                    }
            }
        return split;
    }

  private:
    using Place = std::pair<int, int>;

    bool inside(int x, int y) const {
        return x >= 0 && y >= 0 && x < color_.width && y < color_.height;
    }
    size_t index(int x, int y) const { return size_t(y) * size_t(color_.width) + size_t(x); }
    const Surface& surface(int x, int y) const { return surfaces_[index(x, y)]; }
    bool same(int x, int y, int i, int j) const {
        return one_depth(surface(x, y).inverse_depth, surface(i, j).inverse_depth);
    }
    double light(int x, int y) const {
        const double* rgb = color_.pixel(x, y);
        return std::max({rgb[0], rgb[1], rgb[2]});
    }

    // The adjacent pixel of the surface whose light a pixel shows; none: it shows its own.
    std::optional<Place> shown_at(int x, int y) const {
        const Surface& own = surface(x, y);
        if (!own.edge || light(x, y) <= 0) return std::nullopt;
        std::optional<Place> brightest;
        double most = 0;
        for (const auto& [i, j] : kAround) {
            if (!inside(x + i, y + j) || same(x, y, x + i, y + j)) continue;
            const double there = light(x + i, y + j);
            if (there <= most) continue;
            most = there;
            brightest = Place{x + i, y + j};
        }
        // A pixel as bright as the other surface has light of its own.
        if (!brightest || most <= kOtherBrighter * light(x, y)) return std::nullopt;
        const Surface& other = surface(brightest->first, brightest->second);
        if (apart(own, other, settings_) <= kLampApartPx * kLampApartPx) return std::nullopt;
        // A surface that stays in place keeps the light seen through its edge.
        const bool hides = own.inverse_depth > other.inverse_depth;
        if (hides && longest(own, settings_) <= kStaysPx) return std::nullopt;
        // A light that goes on is no lamp: the pixel is split.
        const int on_x = std::clamp(x + kWidePx * (brightest->first - x), 0, color_.width - 1);
        const int on_y = std::clamp(y + kWidePx * (brightest->second - y), 0, color_.height - 1);
        const Surface& front = hides ? own : other;
        const bool part_far =
            part(own, other, kFarPx, settings_) && leaves(front, kFarPx, settings_);
        if (split_ != Split::none && part_far && light(on_x, on_y) >= kWide * most)
            return std::nullopt;
        const double around = light_around(x, y);
        if (light(x, y) <= kBrighter * around || most <= kLampBrighter * around)
            return std::nullopt;
        // A pixel that shows hardly anything of the lamp behind it goes on hiding that.
        if (hides && light(x, y) - around < kCovered * (most - around)) return std::nullopt;
        return brightest;
    }

    // Largest component of the mean color of the pixel's surface away from edges, in the square of
    // 3 pixels around; if there is none, of its darkest pixel there.
    double light_around(int x, int y) const {
        double darkest = light(x, y);
        std::array<double, 3> sum = {};
        int count = 0;
        for (int j = y - 1; j <= y + 1; ++j)
            for (int i = x - 1; i <= x + 1; ++i) {
                if (!inside(i, j) || !same(x, y, i, j)) continue;
                darkest = std::min(darkest, light(i, j));
                if (surface(i, j).edge) continue;
                for (size_t c = 0; c < 3; ++c) sum[c] += color_.at(i, j, int(c));
                ++count;
            }
        return count > 0 ? std::max({sum[0], sum[1], sum[2]}) / count : darkest;
    }

    const ImageD color_;
    const ImageD* const motion_;
    const std::vector<Surface> surfaces_;
    const Settings& settings_;
    const Split split_;
};

struct Place {
    int x = 0, y = 0;
};

// A neighbor's surfaces in this frame.
class ShownHere {
  public:
    ShownHere(const std::vector<Surface>& here, int width, int height, double offset,
              const Settings& settings)
        : here_(here), width_(width), height_(height), half_open_(half_open_of(settings)) {
        now_.u = -offset / half_open_;
    }

    // The pixel of this frame at the place of surface s, seen in the neighbor's pixel x, y.
    std::optional<Place> place_of(const Surface& s, int x, int y) const {
        const Vec at = Vec{double(x), double(y)} + s.displacement(now_, half_open_);
        const double px = std::floor(at.x + 0.5), py = std::floor(at.y + 0.5);
        if (px < 0 || py < 0 || px >= width_ || py >= height_) return std::nullopt;
        return Place{int(px), int(py)};
    }

    // That pixel, if it shows the surface.
    std::optional<Place> shown_at(const Surface& s, int x, int y) const {
        const std::optional<Place> at = place_of(s, x, y);
        if (!at) return std::nullopt;
        const Surface& t = surface(*at);
        const Vec apart = s.a - t.a;
        if (t.edge || !one_depth(s.inverse_depth, t.inverse_depth) ||
            dot(apart, apart) >
                kOneMotionPx * kOneMotionPx + kOneMotion * kOneMotion * dot(t.a, t.a))
            return std::nullopt;
        return at;
    }

    // Does this frame show something farther there?
    bool refutes(const Surface& s, int x, int y) const {
        const std::optional<Place> at = place_of(s, x, y);
        return at && kFarther * surface(*at).inverse_depth < s.inverse_depth;
    }

  private:
    const Surface& surface(Place at) const {
        return here_[size_t(at.y) * size_t(width_) + size_t(at.x)];
    }

    const std::vector<Surface>& here_;
    const int width_, height_;
    const double half_open_;
    Sample now_;  // this frame's time as seen from the neighbor
};

// light.comp, shown_surfaces.comp
constexpr int kPatchPx = 8;

class Comparison {
  public:
    Comparison(const ShadedFrame& here, const ShadedFrame& there, double offset,
               const Settings& settings)
        : here_(finite_color(here.color)),
          there_(finite_color(there.color)),
          surfaces_there_(there.surfaces),
          shown_here_(here.surfaces, here_.width, here_.height, offset, settings),
          columns_((here_.width + kPatchPx - 1) / kPatchPx),
          rows_((here_.height + kPatchPx - 1) / kPatchPx) {
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x) patches_.push_back(light_of(x, y));
    }

    // Is the light other around surface s, seen in the neighbor's pixel x, y?
    bool has_other_light(const Surface& s, int x, int y) const {
        if (s.inverse_depth < 0 || shown_here_.shown_at(s, x, y)) return false;
        for (int ring = 0; ring <= kLightRings; ++ring) {
            PatchLight sum;
            double apart = 0;
            for (int j = -ring; j <= ring; ++j)
                for (int i = -ring; i <= ring; ++i) {
                    if (std::max(std::abs(i), std::abs(j)) != ring) continue;
                    const PatchLight* patch = patch_at(x / kPatchPx + i, y / kPatchPx + j);
                    if (!patch || patch->count == 0 ||
                        !one_depth(patch->inverse_depth, s.inverse_depth))
                        continue;
                    ++sum.count;
                    sum.here += patch->here;
                    sum.square += patch->square;
                    apart += (patch->there - patch->here) * (patch->there - patch->here);
                }
            if (sum.count == 0) continue;
            const double mean = sum.here / sum.count;
            const double variance = std::max(sum.square / sum.count - mean * mean, 0.0);
            return apart / sum.count > variance + kLightDifference;
        }
        return false;
    }

  private:
    // The farthest surface of a patch that both frames show: means of its brightness.
    struct PatchLight {
        double inverse_depth = 0;  // of its last pixel
        int count = 0;             // 0: none is known
        double here = 0, there = 0, square = 0;
    };
    static double brightness(const double* color, double level) {
        double sum = 0;
        for (int c = 0; c < 3; ++c) sum += as_part_of(std::max(color[c], 0.0), level);
        return sum / 3;
    }

    PatchLight light_of(int column, int row) const {
        struct Pixel {
            double inverse_depth, here, there;
        };
        // The middles of the patch and of those around it.
        std::vector<const double*> middles;
        for (int j = row - 1; j <= row + 1; ++j)
            for (int i = column - 1; i <= column + 1; ++i)
                middles.push_back(
                    here_.pixel(std::clamp(kPatchPx * i + kPatchPx / 2, 0, here_.width - 1),
                                std::clamp(kPatchPx * j + kPatchPx / 2, 0, here_.height - 1)));
        const double level = level_of(middles, kLightLevel);
        std::vector<Pixel> pixels;
        for (int y = row * kPatchPx; y < std::min((row + 1) * kPatchPx, here_.height);
             y += kLightStepPx)
            for (int x = column * kPatchPx; x < std::min((column + 1) * kPatchPx, here_.width);
                 x += kLightStepPx) {
                const Surface& s = surfaces_there_[size_t(y) * size_t(here_.width) + size_t(x)];
                if (s.edge || s.inverse_depth < 0) continue;
                if (const auto at = shown_here_.shown_at(s, x, y))
                    pixels.push_back({s.inverse_depth, brightness(here_.pixel(at->x, at->y), level),
                                      brightness(there_.pixel(x, y), level)});
            }
        // One pass: a pixel that is farther than the surface so far begins anew.
        PatchLight light;
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
        if (light.count < kLightPixels) return {};
        light.here /= light.count;
        light.there /= light.count;
        light.square /= light.count;
        return light;
    }

    const PatchLight* patch_at(int column, int row) const {
        if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return nullptr;
        return &patches_[size_t(row) * size_t(columns_) + size_t(column)];
    }

    const ImageD here_, there_;
    const std::vector<Surface>& surfaces_there_;
    const ShownHere shown_here_;
    const int columns_, rows_;
    std::vector<PatchLight> patches_;
};

// block_surfaces.comp, hidden_surfaces.comp, start_choice.glsl
constexpr int kMoreInRow = 2;
constexpr int kSquarePx = 4;

// surface.glsl
int key_of(double px2) {
    return int((std::bit_cast<uint32_t>(float(px2)) + 0x1555u) >> 13);
}

// A surface from which a search may start, and where it is at this frame's time, from the block
// that shows it, px.
struct Candidate {
    Surface surface;
    Vec shift;
};

class Blocks {
  public:
    Blocks(const std::vector<Surface>& surfaces, int width, int height,
           const std::vector<OtherSurfaces>& others, const Settings& settings)
        : surfaces_(surfaces),
          others_(others),
          s_(settings),
          width_(width),
          height_(height),
          columns_((width + kBlockPx - 1) / kBlockPx),
          rows_((height + kBlockPx - 1) / kBlockPx),
          blocks_(size_t(columns_ * rows_)),
          candidates_(blocks_.size()),
          row_starts_(blocks_.size()) {}

    std::vector<Block> choose() {
        const auto for_each = [&](auto choose_in) {
            for (int j = 0; j < rows_; ++j)
                for (int i = 0; i < columns_; ++i) (this->*choose_in)(i, j);
        };
        for_each(&Blocks::choose_surfaces);
        for_each(&Blocks::choose_hidden);
        for_each(&Blocks::choose_in_row);
        for_each(&Blocks::choose_starts);
        return std::move(blocks_);
    }

  private:
    size_t index(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    size_t block_index(int i, int j) const { return size_t(j * columns_ + i); }
    Block& block(int i, int j) { return blocks_[block_index(i, j)]; }

    // The three surfaces of a block that are displaced most differently.
    void choose_surfaces(int i, int j) {
        Block& b = block(i, j);
        const auto farthest = [&](const auto& measure) {
            int largest = -1;
            Surface best;
            for (int y = j * kBlockPx; y < std::min((j + 1) * kBlockPx, height_); ++y)
                for (int x = i * kBlockPx; x < std::min((i + 1) * kBlockPx, width_); ++x)
                    if (const int key = key_of(measure(surfaces_[index(x, y)])); key > largest) {
                        largest = key;
                        best = surfaces_[index(x, y)];
                    }
            return best;
        };
        b.surfaces[0] = farthest([&](const Surface& s) { return displaced(s, s_); });
        b.surfaces[1] = farthest([&](const Surface& s) { return apart(s, b.surfaces[0], s_); });
        b.surfaces[2] = farthest([&](const Surface& s) {
            return std::min(apart(s, b.surfaces[0], s_), apart(s, b.surfaces[1], s_));
        });
        for (const Surface& s : b.surfaces) candidates_[block_index(i, j)].push_back({s, {}});
    }

    // How differently a hidden surface is displaced from those that the block shows, px^2; 0 if one
    // of them moves alike or none is farther.
    double apart_from(const Block& shown, const Surface& hidden) const {
        double least = 3e38, far = 3e38;
        for (const Surface& t : shown.surfaces) {
            const double px2 = apart(hidden, t, s_);
            if (px2 <= kOneMotionPx * kOneMotionPx + kOneMotion * kOneMotion * displaced(t, s_))
                return 0;
            least = std::min(least, px2);
            far = std::min(far, t.inverse_depth);
        }
        return hidden.inverse_depth > kOneDepth * far ? least : 0;
    }

    // Adds, from this block of each neighbor and of the layer behind, the surface that this frame
    // hides and that is displaced most differently from those shown at its place.
    void choose_hidden(int i, int j) {
        for (const OtherSurfaces& other : others_) {
            const bool neighbor = other.offset != 0;
            const ShownHere shown_here(surfaces_, width_, height_, other.offset, s_);
            int largest = 0;
            Candidate best;
            const auto consider = [&](int x, int y) {
                const Surface& s = (*other.surfaces)[index(x, y)];
                if (s.inverse_depth < 0 || s.edge || s.other_light) return;
                if (neighbor && (shown_here.shown_at(s, x, y) || shown_here.refutes(s, x, y)))
                    return;
                const Candidate hidden =
                    neighbor ? seen_from_here(s, other.offset) : Candidate{s, {}};
                const int key = key_of(apart_from(block_at(x, y, hidden.shift), hidden.surface));
                if (key <= largest) return;
                largest = key;
                best = hidden;
            };
            const int end_x = std::min((i + 1) * kBlockPx, width_);
            const int end_y = std::min((j + 1) * kBlockPx, height_);
            // A neighbor's square by square: on a tie the first wins.
            const int edge = neighbor ? kSquarePx : kBlockPx;
            for (int first_y = j * kBlockPx; first_y < end_y; first_y += edge)
                for (int first_x = i * kBlockPx; first_x < end_x; first_x += edge)
                    for (int y = first_y; y < std::min(first_y + edge, end_y); ++y)
                        for (int x = first_x; x < std::min(first_x + edge, end_x); ++x)
                            consider(x, y);
            if (largest > 0) candidates_[block_index(i, j)].push_back(best);
        }
    }

    // The block of what is so far from a pixel.
    const Block& block_at(int x, int y, Vec shift) {
        const double to_x = std::clamp(x + std::floor(shift.x + 0.5), 0.0, width_ - 1.0);
        const double to_y = std::clamp(y + std::floor(shift.y + 0.5), 0.0, height_ - 1.0);
        return block(int(to_x) / kBlockPx, int(to_y) / kBlockPx);
    }

    // A neighbor's surface as this frame may hide it: it moves straight, as it does between the two
    // frames.
    Candidate seen_from_here(Surface s, double offset) const {
        s.a = s.a - offset * s.b;
        s.b = {};
        s.straight = 0;
        s = stored(s);
        return {s, -offset / half_open_of(s_) * s.a};
    }

    // Can a surface be displaced so many blocks along x, or along y?
    bool reaches(const Candidate& candidate, int blocks, bool along_x) const {
        const Surface& s = candidate.surface;
        double reach = 1 + 1.1 * std::abs(s.radius);
        if (s_.shutter) {
            const double a = along_x ? s.a.x : s.a.y, b = along_x ? s.b.x : s.b.y;
            reach += std::abs(a) + std::abs(b) + 0.1 * std::sqrt(dot(s.a, s.a));
        }
        const double shift = along_x ? candidate.shift.x : candidate.shift.y;
        return reach >= std::max(std::abs(blocks + shift / kBlockPx) - 1, 0.0) * kBlockPx;
    }

    // Up to `count` candidates that are displaced most differently.
    std::vector<Candidate> most_different(const std::vector<Candidate>& candidates,
                                          int count) const {
        std::vector<Candidate> chosen;
        for (int k = 0; k < count; ++k) {
            int largest = key_of(kAlikePx * kAlikePx);
            const Candidate* next = nullptr;
            for (const Candidate& one : candidates) {
                const Surface& s = one.surface;
                double apart_px2 = k == 0 ? displaced(s, s_) + 2 * kAlikePx * kAlikePx : 3e38;
                for (const Candidate& c : chosen)
                    apart_px2 = std::min(apart_px2, apart(s, c.surface, s_));
                if (const int key = key_of(apart_px2); key > largest) {
                    largest = key;
                    next = &one;
                }
            }
            if (!next) break;
            chosen.push_back(*next);
        }
        return chosen;
    }

    // From the candidates of the blocks in its row.
    void choose_in_row(int i, int j) {
        std::vector<Candidate> reaching;
        for (int x = 0; x < columns_; ++x)
            for (const Candidate& one : candidates_[block_index(x, j)])
                if (reaches(one, x - i, true)) reaching.push_back(one);
        row_starts_[block_index(i, j)] =
            most_different(reaching, s_.parameters.search.starts + kMoreInRow);
    }

    // From those that the rows of its column have chosen.
    void choose_starts(int i, int j) {
        std::vector<Candidate> reaching;
        for (int y = 0; y < rows_; ++y)
            for (const Candidate& one : row_starts_[block_index(i, y)])
                if (reaches(one, y - j, false)) reaching.push_back(one);
        Block& b = block(i, j);
        for (const Candidate& one : reaching)
            b.longest_px = std::max(b.longest_px, longest(one.surface, s_));
        for (const Candidate& one : most_different(reaching, s_.parameters.search.starts))
            b.starts.push_back(one.surface);
        std::stable_sort(b.starts.begin(), b.starts.end(), [](const Surface& a, const Surface& c) {
            return a.inverse_depth > c.inverse_depth;
        });
    }

    const std::vector<Surface>& surfaces_;
    const std::vector<OtherSurfaces>& others_;
    const Settings& s_;
    int width_, height_, columns_, rows_;
    std::vector<Block> blocks_;
    std::vector<std::vector<Candidate>> candidates_, row_starts_;
};

}  // namespace

double Surface::path() const {
    const Vec forward = a + b, back = a - b;
    return std::sqrt(std::max(dot(forward, forward), dot(back, back)));
}

Vec Surface::displacement(const Sample& at, double h) const {
    const double u = at.u;
    const double bend = straight * std::abs(u) + (1 - straight) * std::min(h, 1.0) * u * u;
    return u * a + bend * b + radius * at.lens;
}

bool one_depth(double q, double r) {
    return q <= kOneDepth * r && r <= kOneDepth * q;
}

std::vector<Surface> surfaces_of_planes(const Planes& planes, const Settings& settings) {
    return PlaneSurfaces(planes, settings).all();
}

std::vector<Surface> shown_surfaces(const ImageD& color, const ImageD* motion,
                                    std::vector<Surface> of_planes, const Settings& settings,
                                    Split split) {
    return BrightEdges(color, motion, std::move(of_planes), settings, split).shown();
}

double displaced(const Surface& s, const Settings& settings) {
    return (settings.shutter ? dot(s.a, s.a) + dot(s.b, s.b) : 0) + s.radius * s.radius;
}

double apart(const Surface& s, const Surface& t, const Settings& settings) {
    Surface difference;
    difference.a = s.a - t.a;
    difference.b = s.b - t.b;
    difference.radius = s.radius - t.radius;
    return displaced(difference, settings);
}

double longest(const Surface& s, const Settings& settings) {
    return (settings.shutter ? s.path() : 0) + std::abs(s.radius);
}

double level_of(const std::vector<const double*>& places, double times) {
    double roots = 0;
    for (const double* rgb : places)
        for (int c = 0; c < 3; ++c) roots += std::sqrt(std::max(rgb[c], 0.0)) / 3;
    const double mean = roots / double(places.size());
    return std::max(times * mean * mean, 1e-30);
}

double as_part_of(double component, double level) {
    return component / (level + std::abs(component));
}

double half_open_of(const Settings& settings) {
    return settings.shutter ? settings.shutter->half_open : 1;
}

void mark_other_light(const ShadedFrame& here, const ShadedFrame& there, double offset,
                      const Settings& settings, std::vector<Surface>& shown) {
    const Comparison comparison(here, there, offset, settings);
    const size_t width = size_t(here.color.width);
    for (size_t i = 0; i < shown.size(); ++i)
        shown[i].other_light = comparison.has_other_light(shown[i], int(i % width), int(i / width));
}

std::vector<Block> blocks_of(const std::vector<Surface>& surfaces, int width, int height,
                             const std::vector<OtherSurfaces>& others, const Settings& settings) {
    return Blocks(surfaces, width, height, others, settings).choose();
}

}  // namespace postchain::inverse_warp::reference
