#include "tools/stress/image_change.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "chain/base/text.h"

namespace postchain::stress {
namespace {

// Lower limit of the divisor of relative errors, as a fraction of the largest value.
constexpr double kRelativeFloor = 1e-4;

}  // namespace

bool equal_pixel(const ImageF& a, const ImageF& b, size_t pixel) {
    const size_t at = pixel * size_t(a.channels);
    return std::memcmp(&a.data[at], &b.data[at], size_t(a.channels) * sizeof(float)) == 0;
}

double largest_of(const ImageF& image) {
    double most = 0;
    for (float value : image.data) most = std::max(most, std::abs(double(value)));
    return most;
}

double mean_of(const ImageF& image) {
    double sum = 0;
    for (float value : image.data) sum += std::abs(double(value));
    return image.data.empty() ? 0 : sum / double(image.data.size());
}

ImageF changes_of(const ImageF& a, const ImageF& b, double unit) {
    ImageF map(a.width, a.height, 1);
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double change = std::abs(double(a.data[i]) - double(b.data[i])) / unit;
        float& worst = map.data[i / 4];
        if (!(change <= double(worst))) worst = std::isnan(change) ? INFINITY : float(change);
    }
    return map;
}

ImageF errors_of(const ImageF& input, const ImageF& a, const ImageF& b) {
    const double floor = kRelativeFloor * std::max(largest_of(input), 1e-30);
    ImageF map(a.width, a.height, 1);
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double va = a.data[i], vb = b.data[i];
        const double e = std::abs(va - vb) / std::max({std::abs(va), std::abs(vb), floor});
        float& worst = map.data[i / 4];
        if (!(e <= double(worst))) worst = std::isnan(e) ? INFINITY : float(e);
    }
    return map;
}

std::string place_of(const ImageF& image, size_t pixel) {
    return concat("at ", pixel % size_t(image.width), ",", pixel / size_t(image.width));
}

}  // namespace postchain::stress
