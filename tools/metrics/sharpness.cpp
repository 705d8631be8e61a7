#include "tools/metrics/sharpness.h"

#include <algorithm>
#include <cmath>

#include "tools/metrics/display.h"

namespace postchain::metrics {
namespace {

ImageF gradient_energy(const ImageF& luma) {
    ImageF energy(luma.width, luma.height, 1);
    for (int y = 0; y < luma.height; ++y)
        for (int x = 0; x < luma.width; ++x) {
            const auto at = [&](int dx, int dy) {
                return double(luma.at(std::clamp(x + dx, 0, luma.width - 1),
                                      std::clamp(y + dy, 0, luma.height - 1)));
            };
            const double dx = (at(1, 0) - at(-1, 0)) / 2, dy = (at(0, 1) - at(0, -1)) / 2;
            energy.at(x, y) = float(dx * dx + dy * dy);
        }
    return energy;
}

// Smooths along x and transposes; applied twice, it smooths along both axes.
ImageF smoothed_transposed(const ImageF& image) {
    const int radius = int(std::ceil(3 * kRegionSigma));
    std::vector<double> weights;
    double total = 0;
    for (int i = -radius; i <= radius; ++i) {
        weights.push_back(std::exp(-i * i / (2 * kRegionSigma * kRegionSigma)));
        total += weights.back();
    }
    ImageF out(image.height, image.width, 1);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            double sum = 0;
            for (int i = -radius; i <= radius; ++i)
                sum += weights[size_t(i + radius)] *
                       double(image.at(std::clamp(x + i, 0, image.width - 1), y));
            out.at(y, x) = float(sum / total);
        }
    return out;
}

ImageF energy_around(const ImageF& luma) {
    return smoothed_transposed(smoothed_transposed(gradient_energy(luma)));
}

struct Region {
    double test = 0, truth = 0;
    size_t pixels = 0;

    std::optional<double> ratio(size_t of_pixels) const {
        if (pixels == 0 || double(pixels) < kLeastRegion * double(of_pixels)) return std::nullopt;
        const double floor = double(pixels) * kEnergyEpsilon;
        return (test + floor) / (truth + floor);
    }
};

Status check_sizes(const RgbImage& truth, const RgbImage& input) {
    if (input.rgb.width == truth.rgb.width && input.rgb.height == truth.rgb.height) return Status();
    return Status(StatusCode::input,
                  concat("sizes differ: the input has ", input.rgb.width, "x", input.rgb.height,
                         ", the ground truth ", truth.rgb.width, "x", truth.rgb.height));
}

// `test_energy(i, e)`: e of the test at pixel i, given the ground truth's e.
template <class TestEnergy>
Sharpness over_regions(ImageF truth_luma, const RgbImage& input, const TestEnergy& test_energy) {
    const ImageF input_luma = display_luma(input);
    const ImageF truth = energy_around(truth_luma), unblurred = energy_around(input_luma);
    for (size_t i = 0; i < truth_luma.data.size(); ++i) truth_luma.data[i] -= input_luma.data[i];
    const ImageF difference = energy_around(truth_luma);
    Region blurred, sharp;
    for (size_t i = 0; i < truth.data.size(); ++i) {
        const double before = double(unblurred.data[i]), after = double(truth.data[i]);
        if (before < kMinEnergy) continue;
        Region* region = nullptr;
        if (after <= kBlurredPart * before) region = &blurred;
        if (double(difference.data[i]) <= kOtherPart * before) region = &sharp;
        if (!region) continue;
        region->test += test_energy(i, after);
        region->truth += after;
        ++region->pixels;
    }
    const size_t all = truth.data.size();
    return Sharpness{blurred.ratio(all), sharp.ratio(all), blurred.pixels, sharp.pixels};
}

}  // namespace

Result<Sharpness> sharpness(const Pair& truth_pair, const RgbImage& input) {
    RETURN_IF_ERROR(check_sizes(truth_pair.reference, input));
    const ImageF test = energy_around(display_luma(truth_pair.test));
    return over_regions(display_luma(truth_pair.reference), input,
                        [&](size_t i, double) { return double(test.data[i]); });
}

Result<Sharpness> sharpness_without_error(const RgbImage& truth, const ImageF& variance,
                                          const RgbImage& input) {
    RETURN_IF_ERROR(check_sizes(truth, input));
    return over_regions(display_luma(truth), input, [&](size_t i, double energy) {
        return std::max(0.0, energy - double(variance.data[i]));
    });
}

}  // namespace postchain::metrics
