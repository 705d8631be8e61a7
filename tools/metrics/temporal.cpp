#include "tools/metrics/temporal.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/metrics/display.h"

namespace postchain::metrics {
namespace {

template <class A, class B>
Status same_size(const A& a, const B& b) {
    if (a.width == b.width && a.height == b.height) return Status();
    return Status(StatusCode::input, concat("sizes differ: ", a.width, "x", a.height, " against ",
                                            b.width, "x", b.height));
}

// Squared changes of displayed values, and pixels.
struct Changes {
    double error = 0, truth = 0;
    size_t pixels = 0;

    void add(const Changes& more) {
        error += more.error;
        truth += more.truth;
        pixels += more.pixels;
    }
    std::optional<double> value() const {
        if (pixels == 0) return std::nullopt;
        const double components = 3 * double(pixels);
        return std::sqrt(error / components) /
               std::max(std::sqrt(truth / components), kLeastChange);
    }
};

}  // namespace

const std::vector<MetricRow>& temporal_rows() {
    static const std::vector<MetricRow> rows = {
        {"tde", "mean |change of the error| from frame to frame, linear"},
        {"temporal_error",
         "rms change of the displayed error from frame to frame, over the ground truth's own "
         "change"}};
    return rows;
}

const std::vector<MetricRow>& temporal_class_rows() {
    static const std::vector<MetricRow> rows = [] {
        std::vector<MetricRow> made;
        for (const char* name : kPixelClassNames)
            made.push_back({concat("temporal_error_", name),
                            concat("temporal_error of pixels that are ", name)});
        return made;
    }();
    return rows;
}

bool is_temporal(const std::string& name) {
    return std::ranges::any_of(temporal_rows(),
                               [&](const MetricRow& row) { return row.name == name; });
}

Status TemporalError::add(const Pair& pair, Image<PixelClass> classes) {
    last_.clear();
    if (before_) RETURN_IF_ERROR(same_size(pair.test.rgb, before_->test.rgb));
    double linear = 0;
    Changes whole;
    std::array<Changes, kPixelClasses> parts;
    for (size_t i = 0; before_ && i < pair.pixels(); ++i) {
        Changes here = {.pixels = 1};
        for (int c = 0; c < 3; ++c) {
            const float test[] = {before_->test_pixel(i)[c], pair.test_pixel(i)[c]};
            const float truth[] = {before_->reference_pixel(i)[c], pair.reference_pixel(i)[c]};
            const auto change = [](const float(&values)[2]) {
                return double(display_value(values[1])) - double(display_value(values[0]));
            };
            const double changed = change(truth), error = change(test) - changed;
            linear +=
                std::abs(double(test[1]) - double(truth[1]) - (double(test[0]) - double(truth[0])));
            here.error += error * error;
            here.truth += changed * changed;
        }
        whole.add(here);
        if (!classes.empty() && !classes_before_.empty())
            parts[size_t(std::max(classes.data[i], classes_before_.data[i]))].add(here);
    }
    using Value = std::optional<double>;
    last_ = {{"tde", before_ ? Value(linear / (3 * double(pair.pixels()))) : Value()},
             {"temporal_error", whole.value()}};
    for (size_t i = 0; i < kPixelClasses; ++i)
        last_.emplace_back(temporal_class_rows()[i].name, parts[i].value());
    before_ = pair;
    classes_before_ = std::move(classes);
    return Status();
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
