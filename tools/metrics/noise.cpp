#include "tools/metrics/noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/metrics/display.h"
#include "tools/metrics/sharpness.h"

namespace postchain::metrics {
namespace {

double median(std::vector<double>& values) {
    const auto middle = values.begin() + long(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) return *middle;
    return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

}  // namespace

ImageF noise_variance(const ImageF& channel) {
    const int width = channel.width, height = channel.height;
    ImageF variance(width, height, 1);
    if (width < 3 || height < 3) return variance;
    std::vector<double> residuals;
    for (int top = 0; top < height; top += kNoiseTile) {
        for (int left = 0; left < width; left += kNoiseTile) {
            // A border tile is shifted inward, so that all have one size.
            const int y0 = std::max(1, std::min(top, height - 1 - kNoiseTile));
            const int x0 = std::max(1, std::min(left, width - 1 - kNoiseTile));
            residuals.clear();
            for (int y = y0; y < std::min(y0 + kNoiseTile, height - 1); ++y)
                for (int x = x0; x < std::min(x0 + kNoiseTile, width - 1); ++x) {
                    const auto at = [&](int dx, int dy) {
                        return double(channel.at(x + dx, y + dy));
                    };
                    const double r = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1) -
                                     2 * (at(0, -1) + at(-1, 0) + at(1, 0) + at(0, 1)) +
                                     4 * at(0, 0);
                    residuals.push_back(std::abs(r) / 6);
                }
            const double sigma = median(residuals) / kNormalMedian;
            for (int y = top; y < std::min(top + kNoiseTile, height); ++y)
                for (int x = left; x < std::min(left + kNoiseTile, width); ++x)
                    variance.at(x, y) = float(sigma * sigma);
        }
    }
    return variance;
}

namespace {

ImageF channel_of(const RgbImage& image, size_t c, float (*value)(float)) {
    ImageF channel(image.rgb.width, image.rgb.height, 1);
    for (size_t i = 0; i < channel.pixels(); ++i)
        channel.data[i] = value(image.rgb.data[3 * i + c]);
    return channel;
}

double mean_of(const ImageF& image) {
    double sum = 0;
    for (const float v : image.data) sum += double(v);
    return image.data.empty() ? 0 : sum / double(image.data.size());
}

}  // namespace

Result<TruthNoise> truth_noise(const RgbImage& truth, const RgbImage& input) {
    TruthNoise noise;
    const ImageF of_luma = noise_variance(display_luma(truth));
    noise.sigma = std::sqrt(mean_of(of_luma));
    ASSIGN_OR_RETURN(auto sharpness, sharpness_without_error(truth, of_luma, input));
    auto& values = noise.of_no_error;
    if (sharpness.edges_in_blurred) values["edges_in_blurred"] = *sharpness.edges_in_blurred;
    if (sharpness.sharpness_in_focus) values["sharpness_in_focus"] = *sharpness.sharpness_in_focus;
    double linear = 0, displayed = 0;
    for (size_t c = 0; c < 3; ++c) {
        linear += mean_of(noise_variance(channel_of(truth, c, [](float v) { return v; }))) / 3;
        displayed += mean_of(noise_variance(channel_of(truth, c, display_value))) / 3;
    }
    values["mse"] = linear;
    if (displayed > 0) values["psnr"] = -10 * std::log10(displayed);
    return noise;
}

}  // namespace postchain::metrics
