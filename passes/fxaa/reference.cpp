// The double-precision reference of FXAA, see reference.h. Written from docs/fxaa.md: the walk
// really samples a bilinear plane at real positions, the Gaussian along the edge really has an
// angle.
#include "passes/fxaa/reference.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "shaders/shared/color_limits.h"

namespace postchain::fxaa {
namespace {

constexpr double kMaxLuma = 1e30;  // as in luma.glsl: keeps lumas finite

double texel(const ImageD& plane, int x, int y, int c = 0) {
    return plane.at(std::clamp(x, 0, plane.width - 1), std::clamp(y, 0, plane.height - 1), c);
}

// Bilinear sample; integer positions are texel centers.
double bilinear(const ImageD& plane, double x, double y) {
    const double left = std::floor(x);
    const double top = std::floor(y);
    const int x0 = static_cast<int>(left);
    const int y0 = static_cast<int>(top);
    const double fx = x - left;
    const double fy = y - top;
    return (1 - fy) * ((1 - fx) * texel(plane, x0, y0) + fx * texel(plane, x0 + 1, y0)) +
           fy * ((1 - fx) * texel(plane, x0, y0 + 1) + fx * texel(plane, x0 + 1, y0 + 1));
}

// Color, then the extra layers, which decide nothing.
using Pixel = std::vector<double>;

Pixel pixel_at(const ImageD& color, int x, int y) {
    Pixel pixel(static_cast<size_t>(color.channels));
    for (int c = 0; c < color.channels; ++c) pixel[static_cast<size_t>(c)] = texel(color, x, y, c);
    return pixel;
}

double positive_maximum(const Pixel& p) {
    return std::max({p[0], p[1], p[2], 0.0});
}

// Weight of a texel in the mean of a pixel: as often as the pixel, or less if it is brighter, and
// hardly at all if it is a negative infinity.
double brightness_weight(const Parameters& parameters, const Pixel& texel, const Pixel& center) {
    if (std::min({texel[0], texel[1], texel[2]}) <= -double(shared::kMaxHalf)) return 1e-30;
    if (parameters.blend == Blend::stored) return 1;
    const double exposed = std::max(positive_maximum(texel), positive_maximum(center)) *
                           std::exp2(parameters.exposure_ev);
    return 1 / std::sqrt(1 + std::min(exposed, kMaxLuma));
}

// From the pixel's a to b; a itself for weight 0 or equal texels.
Pixel blend(const Parameters& parameters, const Pixel& a, const Pixel& b, double weight) {
    if (weight == 0 || a == b) return a;
    const double wa = (1 - weight) * brightness_weight(parameters, a, a);
    const double wb = weight * brightness_weight(parameters, b, a);
    Pixel mean(a.size());
    for (size_t c = 0; c < mean.size(); ++c) mean[c] = (wa * a[c] + wb * b[c]) / (wa + wb);
    return mean;
}

// The weight with which the pixel moves to (dx, dy) beside it; 0 = it stays.
struct Move {
    int dx = 0;
    int dy = 0;
    double weight = 0;
};

double transparency(const double* rgba) {
    return 1 - std::clamp(rgba[3], 0.0, 1.0);
}

// The local range of luma, or 0 if it is below the thresholds.
double contrast(const Parameters& parameters, const ImageD& color, const ImageD& luma, int x, int y,
                double threshold_scale) {
    double highest = texel(luma, x, y), lowest = highest;
    for (const auto& [dx, dy] : {std::pair{0, -1}, {0, 1}, {-1, 0}, {1, 0}}) {
        highest = std::max(highest, texel(luma, x + dx, y + dy));
        lowest = std::min(lowest, texel(luma, x + dx, y + dy));
    }
    const Thresholds least = thresholds(parameters);
    const double range = highest - lowest;
    // A range within the rounding of 32 bits is not an edge.
    const double finest = 1e-4 * std::max({1.0, std::abs(lowest), std::abs(highest)});
    const double brightest = highest + transparency(color.pixel(x, y));
    const double threshold = threshold_scale * std::max(least.least, brightest * least.relative);
    return range < std::max(threshold, finest) ? 0 : range;
}

Move move_of(const Parameters& parameters, const ImageD& color, const ImageD& luma, int x, int y,
             double threshold_scale) {
    const double range = contrast(parameters, color, luma, x, y, threshold_scale);
    if (range == 0) return {};
    auto at = [&](int dx, int dy) { return texel(luma, x + dx, y + dy); };
    const double center = at(0, 0);
    const double north = at(0, -1), south = at(0, 1), west = at(-1, 0), east = at(1, 0);

    // Second differences, across the rows and across the columns.
    auto bend = [](double a, double middle, double b) { return std::abs(a + b - 2 * middle); };
    const double horizontal_score = 2 * bend(north, center, south) +
                                    bend(at(1, -1), east, at(1, 1)) +
                                    bend(at(-1, -1), west, at(-1, 1));
    const double vertical_score = 2 * bend(west, center, east) +
                                  bend(at(-1, -1), north, at(1, -1)) +
                                  bend(at(-1, 1), south, at(1, 1));
    const bool horizontal = horizontal_score >= vertical_score;

    const double first = horizontal ? north : west;
    const double second = horizontal ? south : east;
    const bool take_first = std::abs(first - center) >= std::abs(second - center);
    const double neighbor = take_first ? first : second;
    const double gradient = std::abs(neighbor - center);
    const double pair_mean = (neighbor + center) / 2;
    Move move;
    (horizontal ? move.dy : move.dx) = take_first ? -1 : 1;

    const double corners = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1);
    const double area = (2 * (north + south + east + west) + corners) / 12 - center;
    const double t = std::min(std::abs(area) / range, 1.0);
    const double smooth = t * t * (3 - 2 * t);
    const double subpix_weight = smooth * smooth * parameters.subpix;

    // The walk, on the line half a texel towards the neighbor.
    struct End {
        double distance = 0;
        double difference = 0;
    };
    const std::vector<double>& steps = preset_steps(parameters.preset);
    auto walk = [&](double direction) {
        End end;
        for (const double step : steps) {
            end.distance += step;
            const double along = direction * end.distance;
            end.difference = bilinear(luma, x + 0.5 * move.dx + (horizontal ? along : 0),
                                      y + 0.5 * move.dy + (horizontal ? 0 : along)) -
                             pair_mean;
            if (std::abs(end.difference) >= gradient / 4) break;
        }
        return end;
    };
    const End negative = walk(-1);
    const End positive = walk(1);
    const End& nearer = negative.distance < positive.distance ? negative : positive;
    double edge_weight = 0;
    if ((nearer.difference < 0) != (center - pair_mean < 0))
        edge_weight = 0.5 - nearer.distance / (negative.distance + positive.distance);
    move.weight = std::max(edge_weight, subpix_weight);
    return move;
}

// mode: directional.
Pixel directional(const Parameters& parameters, const ImageD& color, const ImageD& luma, int x,
                  int y, double threshold_scale) {
    const Pixel center = pixel_at(color, x, y);
    if (contrast(parameters, color, luma, x, y, threshold_scale) == 0) return center;

    double xx = 0, xy = 0, yy = 0;  // structure tensor
    for (const auto& [i, j] : {std::pair{0, 0}, {0, -1}, {0, 1}, {-1, 0}, {1, 0}}) {
        const double gx = texel(luma, x + i + 1, y + j) - texel(luma, x + i - 1, y + j);
        const double gy = texel(luma, x + i, y + j + 1) - texel(luma, x + i, y + j - 1);
        xx += gx * gx;
        xy += gx * gy;
        yy += gy * gy;
    }
    const double trace = xx + yy;
    const double coherence = trace > 0 ? std::hypot(xx - yy, 2 * xy) / trace : 0;
    const double normal = std::atan2(2 * xy, xx - yy) / 2;
    const double across = 0.5 + (0.46 - 0.5) * coherence;
    const double along = 0.5 + (0.8 - 0.5) * coherence;

    Pixel sum(center.size());
    double total = 0;
    for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
            const Pixel one = pixel_at(color, x + i, y + j);
            const double u = (i * std::cos(normal) + j * std::sin(normal)) / across;
            const double v = (j * std::cos(normal) - i * std::sin(normal)) / along;
            const double share =
                std::exp(-(u * u + v * v) / 2) * brightness_weight(parameters, one, center);
            for (size_t c = 0; c < sum.size(); ++c) sum[c] += share * one[c];
            total += share;
        }
    }
    for (double& v : sum) v /= total;
    return sum;
}

}  // namespace

ImageD reference_luma(const Parameters& parameters, const ImageD& color,
                      const std::array<double, 3>& weights) {
    ImageD luma(color.width, color.height, 1);
    const bool display = parameters.luma == Luma::display;
    const std::array<double, 3> used = display ? weights : std::array{0.299, 0.587, 0.114};
    for (int y = 0; y < color.height; ++y) {
        for (int x = 0; x < color.width; ++x) {
            std::array<double, 3> rgb;
            for (int c = 0; c < 3; ++c) {
                const double v = color.at(x, y, c);
                rgb[static_cast<size_t>(c)] = std::clamp(v, -kMaxLuma, kMaxLuma);
            }
            if (display) {
                for (double& v : rgb)
                    v = std::clamp(v * std::exp2(parameters.exposure_ev), 0.0, kMaxLuma);
                const double scale = 1 + std::max({rgb[0], rgb[1], rgb[2]});
                for (double& v : rgb) v = std::sqrt(v / scale);
            }
            luma.at(x, y) = used[0] * rgb[0] + used[1] * rgb[1] + used[2] * rgb[2] -
                            transparency(color.pixel(x, y));
        }
    }
    return luma;
}

ImageD reference_fxaa(const Parameters& parameters, const ImageD& color, const ImageD& luma,
                      const ImageD* hint) {
    // Inside a checkerboard every decision is constant: the upper neighbor, with the F^2 of
    // |A|/range = 2/3.
    const double smooth = (2.0 / 3) * (2.0 / 3) * (3 - 2 * (2.0 / 3));
    const double checkerboard_weight = smooth * smooth * parameters.subpix;
    const bool checkerboard = parameters.hint == Hint::checkerboard;

    ImageD result(color.width, color.height, color.channels);
    for (int y = 0; y < color.height; ++y) {
        for (int x = 0; x < color.width; ++x) {
            double h = 0;
            if (hint) h = hint->at(x, y, parameters.hint_gate == HintGate::pixel ? 1 : 0);
            h = h > 0 ? std::min(h, 1.0) : 0;

            const Pixel center = pixel_at(color, x, y);
            const bool blurred = parameters.where == Where::blurred;
            double scale = 1;
            if (parameters.hint == Hint::threshold) scale = blurred ? 0 : 1 - h;
            Pixel pixel;
            if (parameters.mode == Mode::directional) {
                pixel = directional(parameters, color, luma, x, y, scale);
            } else {
                const Move move = move_of(parameters, color, luma, x, y, scale);
                pixel = blend(parameters, center, pixel_at(color, x + move.dx, y + move.dy),
                              move.weight);
            }
            if (checkerboard && h > 0) {
                const Pixel taps =
                    blend(parameters, center, pixel_at(color, x, y - 1), checkerboard_weight);
                pixel = h == 1 ? taps : blend(parameters, pixel, taps, h);
            }
            const double share = blurred ? h : 1;
            for (int c = 0; c < color.channels; ++c) {
                const double own = center[static_cast<size_t>(c)];
                result.at(x, y, c) = share == 1
                                         ? pixel[static_cast<size_t>(c)]
                                         : own + share * (pixel[static_cast<size_t>(c)] - own);
            }
        }
    }
    return result;
}

}  // namespace postchain::fxaa
