// Tone mappers of HDR-FLIP, and its range of exposures.
//
// Andersson, Nilsson, Shirley, Akenine-Moeller, "Visualizing Errors in Rendered High Dynamic Range
// Images", Eurographics Short Papers 2021. The range depends only on the reference:
//   start = log2(x / largest luminance)   stop = log2(x / median luminance)   tone(x) = 0.85
// Deviations, as guards: luminances that are not positive (or subnormal) are excluded from the
// median. The range is at most 20 stops, cut on the side away from the median (a firefly of 1e10
// then removes exposures that show black, not those that show the image).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/metrics/pair.h"

namespace postchain::metrics {

enum class ToneMapper { aces, reinhard, hable };
const char* name_of(ToneMapper mapper);
const std::vector<std::string>& tone_mapper_names();
std::optional<ToneMapper> find_tone_mapper(const std::string& name);

inline constexpr double kToneTarget = 0.85;  // tone-mapped value that start and stop reach
inline constexpr double kMaxExposureStops = 20;

// (k0 x^2 + k1 x) / (k3 x^2 + k4 x + k5); aces and hable per channel, reinhard on luminance.
struct ToneCurve {
    float k0, k1, k3, k4, k5;
};
ToneCurve curve_of(ToneMapper mapper);
// The x > 0 with curve(x) = value, 0 < value < 1.
double inverse_of(ToneMapper mapper, double value);

// Rec. 709 luminance of linear RGB, with its published weights.
inline constexpr double kLuminance[3] = {0.2126, 0.7152, 0.0722};
double luminance(const float* rgb);

struct ExposureRange {
    double start = 0;  // EV (stops), smallest
    double stop = 0;   // largest
    bool lit = false;  // false: the reference has no light, start = stop = 0

    int count() const;                      // max(2, ceil(stop - start))
    std::vector<double> exposures() const;  // count() of them, equally spaced, both ends included
};

ExposureRange exposure_range(const RgbImage& reference, ToneMapper mapper);
// Joins the ranges of a sequence: smallest start, largest stop, then the guard. Frames without
// light are ignored.
ExposureRange joined(const ExposureRange& a, const ExposureRange& b);

}  // namespace postchain::metrics
