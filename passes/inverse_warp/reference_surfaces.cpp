#include "passes/inverse_warp/reference_surfaces.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace postchain::inverse_warp::reference {
namespace {

// Forward and backward motion of a pixel, px per frame.
struct Motion {
    Vec forward, back;
};
double apart(const Motion& a, const Motion& b) {
    const Vec f = a.forward - b.forward, k = a.back - b.back;
    return dot(f, f) + dot(k, k);
}

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

class Frame {
  public:
    Frame(const Planes& planes, const Settings& settings)
        : planes_(planes),
          settings_(settings),
          width_(planes.inverse_depth->width),
          height_(planes.inverse_depth->height) {}

    Surface surface(int x, int y) const {
        Surface s;
        s.inverse_depth = depth(x, y);
        const Motion chosen = own_motion(x, y, s.edge);
        const double h = half_open_of(settings_);
        s.a = 0.5 * h * (chosen.forward + chosen.back);
        s.b = 0.5 * h * (chosen.forward - chosen.back);
        // |b|/|a| from 0.8 to 1.2.
        const double ratio = dot(s.b, s.b) / std::max(dot(s.a, s.a), 1e-6);
        const double t = std::clamp((ratio - 0.64) / (1.44 - 0.64), 0.0, 1.0);
        s.straight = t * t * (3 - 2 * t);
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

  private:
    double depth(int x, int y) const {
        const double q = planes_.inverse_depth->at(x, y);
        if (planes_.of_neighbor && q < 0) return kNotThere;
        return q > 0 ? std::min(q, 3e38) : 0;
    }

    Motion motion(int x, int y) const {
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

    // At an edge, of the pixels of this surface next to this one and itself, the motion that
    // differs most from that of the other surface.
    Motion own_motion(int x, int y, bool& edge) const {
        Motion chosen = motion(x, y);
        std::array<Motion, 4> around;
        std::array<bool, 4> same;
        Motion other;
        int count = 0;
        // Left, right, up, down: as many as lie on another surface.
        const std::array<std::array<int, 2>, 4> steps = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
        for (size_t i = 0; i < 4; ++i) {
            const int nx = std::clamp(x + steps[i][0], 0, width_ - 1);
            const int ny = std::clamp(y + steps[i][1], 0, height_ - 1);
            around[i] = motion(nx, ny);
            same[i] = one_depth(depth(x, y), depth(nx, ny));
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

}  // namespace

double Surface::path() const {
    const Vec forward = a + b, back = a - b;
    return std::sqrt(std::max(dot(forward, forward), dot(back, back)));
}

Vec Surface::at(const Sample& sample, double h) const {
    const double u = sample.u;
    const double bend = straight * std::abs(u) + (1 - straight) * std::min(h, 1.0) * u * u;
    return u * a + bend * b + radius * sample.lens;
}

bool one_depth(double q, double r) {
    return q <= kOneDepth * r && r <= kOneDepth * q;
}

std::vector<Surface> surfaces_of(const Planes& planes, const Settings& settings) {
    const Frame frame(planes, settings);
    std::vector<Surface> surfaces;
    for (int y = 0; y < planes.inverse_depth->height; ++y)
        for (int x = 0; x < planes.inverse_depth->width; ++x)
            surfaces.push_back(frame.surface(x, y));
    return surfaces;
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

bool finite(const double* rgba) {
    return std::all_of(rgba, rgba + 4, [](double x) { return std::isfinite(x); });
}

double largest(const double* rgb) {
    return std::max({rgb[0], rgb[1], rgb[2]});
}

double half_open_of(const Settings& settings) {
    return settings.shutter ? settings.shutter->half_open : 1;
}

}  // namespace postchain::inverse_warp::reference
