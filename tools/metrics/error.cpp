#include "tools/metrics/error.h"

#include <algorithm>
#include <cmath>

namespace postchain::metrics {
namespace {

double squared(double v) {
    return v * v;
}

double squared_error(double test, double reference) {
    return squared(test - reference);
}

double relative_error(double test, double reference) {
    return squared((test - reference) / (std::abs(reference) + kRelMseEpsilon));
}

double symmetric_error(double test, double reference) {
    return 2 * std::abs(test - reference) / (std::abs(test) + std::abs(reference) + kSmapeEpsilon);
}

template <class F>
double pixel_mean(const Pair& pair, size_t i, F&& error) {
    const float* test = pair.test_pixel(i);
    const float* reference = pair.reference_pixel(i);
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += error(double(test[c]), double(reference[c]));
    return sum / 3;
}

template <class F>
double mean(const Pair& pair, F&& error) {
    double sum = 0;
    for (size_t i = 0; i < pair.pixels(); ++i) sum += pixel_mean(pair, i, error);
    return sum / double(pair.pixels());
}

template <class F>
ImageF map_of(const Pair& pair, F&& value) {
    ImageF map(pair.width(), pair.height(), 1);
    for (size_t i = 0; i < pair.pixels(); ++i) map.data[i] = float(value(i));
    return map;
}

double largest_difference(const Pair& pair, size_t i) {
    double largest = 0;
    for (int c = 0; c < 3; ++c)
        largest = std::max(
            largest, std::abs(double(pair.test_pixel(i)[c]) - double(pair.reference_pixel(i)[c])));
    return largest;
}

}  // namespace

double mse(const Pair& pair) {
    return mean(pair, squared_error);
}

double relmse(const Pair& pair) {
    return mean(pair, relative_error);
}

double smape(const Pair& pair) {
    return mean(pair, symmetric_error);
}

double relmse_trimmed(const Pair& pair) {
    std::vector<double> errors(pair.pixels());
    for (size_t i = 0; i < errors.size(); ++i) errors[i] = pixel_mean(pair, i, relative_error);
    const size_t kept = errors.size() - size_t(kTrimmedPart * double(errors.size()));
    if (kept < errors.size())
        std::nth_element(errors.begin(), errors.begin() + ptrdiff_t(kept), errors.end());
    double sum = 0;
    for (size_t i = 0; i < kept; ++i) sum += errors[i];
    return sum / double(kept);
}

Percentiles difference_percentiles(const Pair& pair) {
    std::vector<double> differences(pair.pixels());
    for (size_t i = 0; i < differences.size(); ++i) differences[i] = largest_difference(pair, i);
    const auto rank = [&](size_t percent) {
        // Integer arithmetic: 0.95 * 20 is not exactly 19.
        const size_t index = (percent * differences.size() + 99) / 100 - 1;
        std::nth_element(differences.begin(), differences.begin() + ptrdiff_t(index),
                         differences.end());
        return differences[index];
    };
    return {rank(50), rank(95), rank(99), rank(100)};
}

ImageF relmse_map(const Pair& pair) {
    return map_of(pair, [&](size_t i) { return pixel_mean(pair, i, relative_error); });
}

ImageF smape_map(const Pair& pair) {
    return map_of(pair, [&](size_t i) { return pixel_mean(pair, i, symmetric_error); });
}

ImageF difference_map(const Pair& pair) {
    return map_of(pair, [&](size_t i) { return largest_difference(pair, i); });
}

}  // namespace postchain::metrics
