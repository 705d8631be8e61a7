#include "tools/metrics/display.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace postchain::metrics {
namespace {

std::array<double, kSsimWindow> gaussian() {
    std::array<double, kSsimWindow> weights;
    double sum = 0;
    for (int i = 0; i < kSsimWindow; ++i) {
        const double d = i - kSsimWindow / 2;
        weights[size_t(i)] = std::exp(-d * d / (2 * kSsimSigma * kSsimSigma));
        sum += weights[size_t(i)];
    }
    for (double& w : weights) w /= sum;
    return weights;
}

// Weighted means of a, b, a^2, b^2, ab over a window. In double, because variances are differences
// of nearly equal numbers.
struct Moments {
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

    void add(double weight, const Moments& o) {
        a += weight * o.a;
        b += weight * o.b;
        aa += weight * o.aa;
        bb += weight * o.bb;
        ab += weight * o.ab;
    }
};

double similarity(const Moments& m) {
    constexpr double c1 = kSsimK1 * kSsimK1, c2 = kSsimK2 * kSsimK2;
    const double variances = (m.aa - m.a * m.a) + (m.bb - m.b * m.b);
    const double covariance = m.ab - m.a * m.b;
    return (2 * m.a * m.b + c1) * (2 * covariance + c2) /
           ((m.a * m.a + m.b * m.b + c1) * (variances + c2));
}

}  // namespace

float display_value(float v) {
    v = std::max(v, 0.0f);
    return std::pow(v / (1 + v), float(1 / kDisplayGamma));
}

ImageF display_luma(const RgbImage& image) {
    ImageF luma(image.rgb.width, image.rgb.height, 1);
    for (size_t i = 0; i < luma.data.size(); ++i) {
        double sum = 0;
        for (size_t c = 0; c < 3; ++c)
            sum += kDisplayLuma[c] * double(display_value(image.rgb.data[3 * i + c]));
        luma.data[i] = float(sum);
    }
    return luma;
}

std::optional<double> psnr(const Pair& pair) {
    double sum = 0;
    for (size_t i = 0; i < pair.test.rgb.data.size(); ++i) {
        const double d = double(display_value(pair.test.rgb.data[i])) -
                         double(display_value(pair.reference.rgb.data[i]));
        sum += d * d;
    }
    if (sum == 0) return std::nullopt;
    return 10 * std::log10(double(pair.test.rgb.data.size()) / sum);
}

std::optional<double> ssim(const Pair& pair) {
    const int columns = pair.width() - kSsimWindow + 1, rows = pair.height() - kSsimWindow + 1;
    if (columns <= 0 || rows <= 0) return std::nullopt;
    const auto weights = gaussian();
    const ImageF a = display_luma(pair.test), b = display_luma(pair.reference);
    double sum = 0;
    std::vector<Moments> vertical(size_t(pair.width()));
    for (int y = 0; y < rows; ++y) {
        std::ranges::fill(vertical, Moments());
        for (int k = 0; k < kSsimWindow; ++k) {
            const float* row_a = a.pixel(0, y + k);
            const float* row_b = b.pixel(0, y + k);
            for (size_t x = 0; x < vertical.size(); ++x) {
                const double va = row_a[x], vb = row_b[x];
                vertical[x].add(weights[size_t(k)], {va, vb, va * va, vb * vb, va * vb});
            }
        }
        for (int x = 0; x < columns; ++x) {
            Moments window;
            for (int k = 0; k < kSsimWindow; ++k)
                window.add(weights[size_t(k)], vertical[size_t(x + k)]);
            sum += similarity(window);
        }
    }
    return sum / (double(columns) * double(rows));
}

}  // namespace postchain::metrics
