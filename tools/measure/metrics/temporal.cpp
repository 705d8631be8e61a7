#include "tools/measure/metrics/temporal.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace postchain::metrics {
namespace {

template <class A, class B>
Status same_size(const A& a, const B& b) {
    if (a.width == b.width && a.height == b.height) return Status();
    return Status(StatusCode::input, concat("sizes differ: ", a.width, "x", a.height, " against ",
                                            b.width, "x", b.height));
}

}  // namespace

Status TemporalError::add(const Pair& pair) {
    ImageF now(pair.width(), pair.height(), 3);
    for (size_t i = 0; i < now.data.size(); ++i)
        now.data[i] = pair.test.rgb.data[i] - pair.reference.rgb.data[i];
    if (!before_.empty()) {
        RETURN_IF_ERROR(same_size(now, before_));
        double sum = 0;
        for (size_t i = 0; i < now.data.size(); ++i)
            sum += std::abs(double(now.data[i]) - double(before_.data[i]));
        last_ = sum / double(now.data.size());
        sum_ += *last_;
        ++steps_;
    }
    before_ = std::move(now);
    return Status();
}

std::optional<double> TemporalError::mean() const {
    if (steps_ == 0) return std::nullopt;
    return sum_ / steps_;
}

Status Flicker::add(const RgbImage& image) {
    if (seeds_ == 0) {
        mean_ = ImageD(image.rgb.width, image.rgb.height, 3);
        squares_ = mean_;
    }
    RETURN_IF_ERROR(same_size(image.rgb, mean_));
    ++seeds_;
    for (size_t i = 0; i < mean_.data.size(); ++i) {
        const double v = double(image.rgb.data[i]);
        const double before = v - mean_.data[i];
        mean_.data[i] += before / seeds_;
        squares_.data[i] += before * (v - mean_.data[i]);
    }
    return Status();
}

std::optional<double> Flicker::mean() const {
    if (seeds_ < 2) return std::nullopt;
    double sum = 0;
    for (double squares : squares_.data) sum += std::sqrt(squares / (seeds_ - 1));
    return sum / double(squares_.data.size());
}

ImageF shifted(const ImageF& image, int dx, int dy) {
    ImageF moved(image.width, image.height, image.channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const float* from = image.pixel(std::clamp(x - dx, 0, image.width - 1),
                                            std::clamp(y - dy, 0, image.height - 1));
            std::copy(from, from + image.channels, moved.pixel(x, y));
        }
    return moved;
}

Status GridError::add(const RgbImage& filtered_of_shifted, const RgbImage& filtered, int dx,
                      int dy) {
    const ImageF& a = filtered_of_shifted.rgb;
    const ImageF& b = filtered.rgb;
    RETURN_IF_ERROR(same_size(a, b));
    // The pixel of a and its counterpart in b are both away from the edges.
    const int x0 = margin_ + std::max(dx, 0), x1 = a.width - margin_ + std::min(dx, 0);
    const int y0 = margin_ + std::max(dy, 0), y1 = a.height - margin_ + std::min(dy, 0);
    if (x0 >= x1 || y0 >= y1)
        return Status(StatusCode::input,
                      concat("a margin of ", margin_, " and a shift of (", dx, ", ", dy,
                             ") leave no pixels in ", a.width, "x", a.height, " pixels"));
    double sum = 0;
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            for (int c = 0; c < 3; ++c)
                sum += std::abs(double(a.at(x, y, c)) - double(b.at(x - dx, y - dy, c)));
    sum_ += sum / (3.0 * (x1 - x0) * (y1 - y0));
    ++shifts_;
    return Status();
}

std::optional<double> GridError::mean() const {
    if (shifts_ == 0) return std::nullopt;
    return sum_ / shifts_;
}

}  // namespace postchain::metrics
