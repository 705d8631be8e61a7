#include "tools/metrics/exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace postchain::metrics {
namespace {

ExposureRange guarded(ExposureRange range) {
    range.start = std::max(range.start, range.stop - kMaxExposureStops);
    return range;
}

// Hable's filmic curve ((x(Ax+CB)+DE)/(x(Ax+B)+DF) - E/F) as one fraction, with exposure 2 and
// white 11.2 folded into its coefficients.
ToneCurve hable() {
    constexpr double a = 0.15, b = 0.50, c = 0.10, d = 0.20, e = 0.02, f = 0.30;
    constexpr double white = 11.2, gain = 2;
    constexpr double k0 = a * f - a * e, k1 = c * b * f - b * e;
    constexpr double k3 = a * f, k4 = b * f, k5 = d * f * f;
    constexpr double scale =
        (k3 * white * white + k4 * white + k5) / (k0 * white * white + k1 * white);
    return {float(gain * gain * k0 * scale), float(gain * k1 * scale), float(gain * gain * k3),
            float(gain * k4), float(k5)};
}

}  // namespace

const std::vector<std::string>& tone_mapper_names() {
    static const std::vector<std::string> names = {"aces", "reinhard", "hable"};
    return names;
}

const char* name_of(ToneMapper mapper) {
    return tone_mapper_names()[size_t(mapper)].c_str();
}

std::optional<ToneMapper> find_tone_mapper(const std::string& name) {
    const auto found = std::ranges::find(tone_mapper_names(), name);
    if (found == tone_mapper_names().end()) return std::nullopt;
    return ToneMapper(found - tone_mapper_names().begin());
}

ToneCurve curve_of(ToneMapper mapper) {
    switch (mapper) {
        case ToneMapper::aces: {
            // Narkowicz's fit (2.51 x^2 + 0.03 x) / (2.43 x^2 + 0.59 x + 0.14), evaluated at 0.6 x.
            constexpr double gain = 0.6;
            return {float(2.51 * gain * gain), float(0.03 * gain), float(2.43 * gain * gain),
                    float(0.59 * gain), 0.14f};
        }
        case ToneMapper::reinhard:
            return {0, 1, 0, 1, 1};
        case ToneMapper::hable:
            return hable();
    }
    return {0, 1, 0, 0, 1};
}

double inverse_of(ToneMapper mapper, double value) {
    // (k0 - v k3) x^2 + (k1 - v k4) x - v k5 = 0
    const ToneCurve k = curve_of(mapper);
    const double a = double(k.k0) - value * double(k.k3);
    const double b = double(k.k1) - value * double(k.k4);
    const double c = -value * double(k.k5);
    if (std::abs(a) < 1e-12) return -c / b;
    return (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
}

double luminance(const float* rgb) {
    double y = 0;
    for (size_t c = 0; c < 3; ++c) y += kLuminance[c] * double(rgb[c]);
    return y;
}

int ExposureRange::count() const {
    return std::max(2, int(std::ceil(stop - start)));
}

std::vector<double> ExposureRange::exposures() const {
    const int n = count();
    std::vector<double> all;
    for (int i = 0; i < n; ++i) all.push_back(start + (stop - start) * i / (n - 1));
    return all;
}

ExposureRange exposure_range(const RgbImage& reference, ToneMapper mapper) {
    std::vector<double> lights;
    for (size_t i = 0; i < reference.rgb.pixels(); ++i) {
        const double y = luminance(reference.rgb.data.data() + 3 * i);
        if (y >= double(std::numeric_limits<float>::min())) lights.push_back(y);
    }
    if (lights.empty()) return {};
    const double largest = *std::ranges::max_element(lights);
    const auto median = lights.begin() + ptrdiff_t(lights.size() / 2);
    std::nth_element(lights.begin(), median, lights.end());
    const double x = inverse_of(mapper, kToneTarget);
    return guarded({std::log2(x / largest), std::log2(x / *median), true});
}

ExposureRange joined(const ExposureRange& a, const ExposureRange& b) {
    if (!a.lit) return b;
    if (!b.lit) return a;
    return guarded({std::min(a.start, b.start), std::max(a.stop, b.stop), true});
}

}  // namespace postchain::metrics
