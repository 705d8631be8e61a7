// Pixel error metrics of linear values: MSE, relMSE, SMAPE, distribution of differences. I = test,
// R = reference. Formulas: docs/metrics.md.
#pragma once

#include "tools/metrics/pair.h"

namespace postchain::metrics {

// (I-R)^2 / (|R| + kRelMseEpsilon)^2
inline constexpr double kRelMseEpsilon = 0.01;
// 2|I-R| / (|I| + |R| + kSmapeEpsilon)
inline constexpr double kSmapeEpsilon = 0.02;
// Fraction of the pixels, those with the largest relMSE, that relmse_trimmed excludes.
inline constexpr double kTrimmedPart = 0.001;

double mse(const Pair& pair);     // mean over pixels and RGB of (I-R)^2
double relmse(const Pair& pair);  // mean over pixels and RGB
double smape(const Pair& pair);   // mean over pixels and RGB; in 0..2
// relmse without the floor(kTrimmedPart * pixels) worst pixels.
double relmse_trimmed(const Pair& pair);

// Percentiles of each pixel's largest |I-R| over RGB. Percentile p is the nearest rank: the
// ceil(p/100 * pixels)-th smallest, 1-based.
struct Percentiles {
    double p50 = 0;
    double p95 = 0;
    double p99 = 0;
    double max = 0;
};
Percentiles difference_percentiles(const Pair& pair);

// One channel, in the size of the pair. relMSE and SMAPE are means over RGB, the difference is the
// maximum over RGB.
ImageF relmse_map(const Pair& pair);
ImageF smape_map(const Pair& pair);
ImageF difference_map(const Pair& pair);

}  // namespace postchain::metrics
