// FLIP and HDR-FLIP against a second, direct implementation: the papers' formulas with
// two-dimensional kernels and YCxCz, in double.
#include <cmath>
#include <functional>
#include <random>

#include "tests/metrics/support.h"
#include "tools/metrics/flip.h"

namespace postchain::metrics {
namespace {

constexpr double kPi = 3.14159265358979323846;

using Plane = std::vector<Rgb>;

struct Plain {
    int width, height;
    double ppd;

    // sum over a square of weight(i, j) * value, edges replicated
    template <class W>
    Rgb convolved(const Plane& plane, int x, int y, int radius, W&& weight) const {
        Rgb sum = {0, 0, 0};
        for (int j = -radius; j <= radius; ++j)
            for (int i = -radius; i <= radius; ++i) {
                const Rgb w = weight(i, j);
                const int xx = std::clamp(x + i, 0, width - 1);
                const int yy = std::clamp(y + j, 0, height - 1);
                for (size_t c = 0; c < 3; ++c) sum[c] += w[c] * plane[size_t(yy * width + xx)][c];
            }
        return sum;
    }

    static Rgb xyz(const Rgb& v) {
        const double m[3][3] = {
            {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
            {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
            {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
        Rgb out;
        for (size_t i = 0; i < 3; ++i) {
            const double white = m[i][0] + m[i][1] + m[i][2];
            out[i] = (m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2]) / white;
        }
        return out;
    }

    // Inverse of xyz() by Cramer's rule.
    static Rgb rgb(const Rgb& v) {
        const Rgb a = xyz({1, 0, 0}), b = xyz({0, 1, 0}), c = xyz({0, 0, 1});
        const auto det = [](const Rgb& p, const Rgb& q, const Rgb& r) {
            return p[0] * (q[1] * r[2] - q[2] * r[1]) - q[0] * (p[1] * r[2] - p[2] * r[1]) +
                   r[0] * (p[1] * q[2] - p[2] * q[1]);
        };
        const double d = det(a, b, c);
        return {det(v, b, c) / d, det(a, v, c) / d, det(a, b, v) / d};
    }

    static Rgb hunt_lab(const Rgb& linear) {
        Rgb f = xyz(linear);
        for (double& t : f) t = t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
        const double l = 116 * f[1] - 16;
        return {l, 500 * (f[0] - f[1]) * l / 100, 200 * (f[1] - f[2]) * l / 100};
    }

    static double color_difference(const Rgb& p, const Rgb& q) {
        return std::pow(std::abs(p[0] - q[0]) + std::hypot(p[1] - q[1], p[2] - q[2]), 0.7);
    }

    // Hunt-adjusted Lab of the filtered image.
    Plane seen(const Plane& linear) const {
        Plane opponent;
        for (const Rgb& v : linear) {
            const Rgb t = xyz(v);
            opponent.push_back({116 * t[1] - 16, 500 * (t[0] - t[1]), 200 * (t[1] - t[2])});
        }
        const int radius = int(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * ppd));
        const auto term = [&](double a, double b, int i, int j) {
            const double d2 = (i * i + j * j) / (ppd * ppd);
            return a * std::sqrt(kPi / b) * std::exp(-kPi * kPi * d2 / b);
        };
        const auto raw = [&](int i, int j) {
            return Rgb{term(1, 0.0047, i, j), term(1, 0.0053, i, j),
                       term(34.1, 0.04, i, j) + term(13.5, 0.025, i, j)};
        };
        Rgb total = {0, 0, 0};
        for (int j = -radius; j <= radius; ++j)
            for (int i = -radius; i <= radius; ++i)
                for (size_t c = 0; c < 3; ++c) total[c] += raw(i, j)[c];
        Plane out;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Rgb v = convolved(opponent, x, y, radius, [&](int i, int j) {
                    const Rgb w = raw(i, j);
                    return Rgb{w[0] / total[0], w[1] / total[1], w[2] / total[2]};
                });
                const double t = (v[0] + 16) / 116;
                Rgb back = rgb({v[1] / 500 + t, t, t - v[2] / 200});
                for (double& value : back) value = std::clamp(value, 0.0, 1.0);
                out.push_back(hunt_lab(back));
            }
        return out;
    }

    // Strength of edges and points: Rgb{edge, point, 0}.
    Plane features(const Plane& linear) const {
        Plane luminance;
        for (const Rgb& v : linear) luminance.push_back({xyz(v)[1], xyz(v)[1], xyz(v)[1]});
        const double s = 0.5 * 0.082 * ppd;
        const int radius = int(std::ceil(3 * s));
        const auto derivative = [&](int order, int i, int j) {
            const double g = std::exp(-(i * i + j * j) / (2 * s * s));
            return order == 1 ? -i * g : (i * i / (s * s) - 1) * g;
        };
        double positive[3] = {}, negative[3] = {};
        for (int order : {1, 2})
            for (int j = -radius; j <= radius; ++j)
                for (int i = -radius; i <= radius; ++i) {
                    const double w = derivative(order, i, j);
                    (w > 0 ? positive : negative)[order] += std::abs(w);
                }
        const auto weight = [&](int order, int i, int j) {
            const double w = derivative(order, i, j);
            return w / (w > 0 ? positive : negative)[order];
        };
        Plane out;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                Rgb strength = {0, 0, 0};
                for (int order : {1, 2}) {
                    const Rgb v = convolved(luminance, x, y, radius, [&](int i, int j) {
                        return Rgb{weight(order, i, j), weight(order, j, i), 0.0};
                    });
                    strength[size_t(order - 1)] = std::hypot(v[0], v[1]);
                }
                out.push_back(strength);
            }
        return out;
    }

    std::vector<double> flip(const Plane& test, const Plane& reference) const {
        const Plane a = seen(test), b = seen(reference);
        const Plane fa = features(test), fb = features(reference);
        const double largest = color_difference(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1}));
        std::vector<double> out;
        for (size_t i = 0; i < a.size(); ++i) {
            const double color = color_difference(a[i], b[i]), knee = 0.4 * largest;
            const double mapped = color < knee ? 0.95 / knee * color
                                               : 0.95 + 0.05 * (color - knee) / (largest - knee);
            const double feature =
                std::max(std::abs(fa[i][0] - fb[i][0]), std::abs(fa[i][1] - fb[i][1]));
            out.push_back(std::pow(mapped, 1 - std::sqrt(feature / std::sqrt(2.0))));
        }
        return out;
    }
};

Plane plane_of(const ImageF& image, const std::function<Rgb(Rgb)>& shown) {
    Plane plane;
    for (size_t i = 0; i < image.pixels(); ++i) {
        Rgb v = shown({image.data[3 * i], image.data[3 * i + 1], image.data[3 * i + 2]});
        for (double& value : v) value = std::clamp(value, 0.0, 1.0);
        plane.push_back(v);
    }
    return plane;
}

// Saturated blocks and noise: filtered opponent channels leave the gamut at their borders.
ImageF scene(uint32_t seed, double brightest) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const Rgb colors[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}, {1, 1, 0}, {1, 1, 1}};
    return make_image(26, 21, [&](int x, int y) {
        const Rgb& color = colors[size_t((x / 7 + 2 * (y / 6) + int(seed)) % 6)];
        const double gain = brightest * (0.4 + 0.6 * uniform(random));
        return Rgb{color[0] * gain, color[1] * gain, color[2] * gain};
    });
}

constexpr double kTolerance = 5e-5;  // per pixel: the implementation is in float

TEST(FlipReference, EveryPixelOfFlip) {
    const auto test = scene(1, 1), reference = scene(2, 1);
    const auto as_is = [](Rgb v) { return v; };
    for (double ppd : {67.02, 30.0}) {
        const Plain plain = {26, 21, ppd};
        const auto expected = plain.flip(plane_of(test, as_is), plane_of(reference, as_is));
        FlipSettings settings;
        settings.pixels_per_degree = ppd;
        const ImageF map = flip(pair(test, reference), settings).map;
        double sum = 0;
        for (size_t i = 0; i < expected.size(); ++i) {
            EXPECT_NEAR(map.data[i], expected[i], kTolerance) << i << " at " << ppd;
            sum += expected[i];
        }
        EXPECT_GT(sum / double(expected.size()), 0.1);
    }
}

TEST(FlipReference, EveryPixelOfHdrFlip) {
    const auto test = scene(3, 20), reference = scene(4, 20);
    const Pair both = pair(test, reference);
    const auto range = exposure_range(both.reference, ToneMapper::reinhard);
    ASSERT_GE(range.count(), 2);
    std::vector<double> expected(both.pixels(), 0);
    for (int i = 0; i < range.count(); ++i) {
        const double ev = range.start + (range.stop - range.start) * i / (range.count() - 1);
        const auto shown = [&](Rgb v) {
            const double gain = std::exp2(ev);
            const double y = gain * (0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]);
            return Rgb{gain * v[0] / (1 + y), gain * v[1] / (1 + y), gain * v[2] / (1 + y)};
        };
        const Plain plain = {26, 21, 67.02};
        const auto one_exposure = plain.flip(plane_of(test, shown), plane_of(reference, shown));
        for (size_t p = 0; p < expected.size(); ++p)
            expected[p] = std::max(expected[p], one_exposure[p]);
    }
    FlipSettings settings;
    settings.tone_mapper = ToneMapper::reinhard;
    const ImageF map = hdr_flip(both, range, settings).map;
    for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_NEAR(map.data[i], expected[i], kTolerance) << i;
}

}  // namespace
}  // namespace postchain::metrics
