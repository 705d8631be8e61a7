#include "chain/frame/bokeh_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "chain/base/parameter.h"

namespace postchain {
namespace {

constexpr int kSide = BokehKernel::kSide;
// Angles that at the rim are less than half a cell of the table apart, rings of a quarter.
constexpr int kAngles = 8 * kSide;
constexpr int kRings = 2 * kSide;
constexpr double kStep = 2 * std::numbers::pi / kAngles;

// Position of a share in 0..1 in an ascending list from 0 to 1: the index before it and the
// fraction of the way to the next value.
template <class T>
double place_of(double share, const std::vector<T>& ascending) {
    share = std::clamp(share, 0.0, 1 - 0x1p-30);
    const auto above = std::upper_bound(ascending.begin(), ascending.end(), share);
    const double low = *(above - 1), high = *above;
    return double(above - ascending.begin() - 1) + (share - low) / (high - low);
}

Status check(const std::vector<float>& values) {
    if (values.size() != size_t(kSide) * kSide)
        return Status(StatusCode::input, concat("an aperture's table has ", kSide, " x ", kSide,
                                                " values, not ", values.size()));
    for (size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]) || values[i] < 0)
            return Status(StatusCode::input,
                          concat("column ", i % kSide, ", row ", i / kSide, " is ", values[i],
                                 "; the light that passes is a finite number >= 0"));
    return Status();
}

}  // namespace

Result<BokehKernel> BokehKernel::make(std::vector<float> values, std::string file) {
    RETURN_IF_ERROR(check(values));
    Distribution light;
    const auto cell = [](double x) { return std::min(int((x + 1) / 2 * kSide), kSide - 1); };
    light.turned = {0};
    for (int i = 0; i < kAngles; ++i) {
        const double cosine = std::cos((i + 0.5) * kStep), sine = std::sin((i + 0.5) * kStep);
        std::array<double, kRings + 1> sums;
        sums[0] = 0;
        for (size_t ring = 0; ring < kRings; ++ring) {
            const double radius = (double(ring) + 0.5) / kRings;
            const int x = cell(radius * cosine), y = cell(radius * sine);
            // A ring's area is in proportion to its radius.
            sums[ring + 1] = sums[ring] + radius * double(values[size_t(y * kSide + x)]);
        }
        std::vector<float> within(kRings + 1);
        if (sums.back() > 0)
            for (size_t ring = 0; ring <= kRings; ++ring)
                within[ring] = float(sums[ring] / sums.back());
        light.within.push_back(std::move(within));
        light.turned.push_back(light.turned.back() + sums.back());
    }
    const double all = light.turned.back();
    if (!(all > 0)) {
        const bool outside =
            std::any_of(values.begin(), values.end(), [](float v) { return v > 0; });
        return Status(StatusCode::input,
                      outside ? "light passes in the corners alone, outside the circle that fills "
                                "the picture; move the shape to the middle"
                              : "no light passes, all of it is black; what passes light is white");
    }
    for (double& share : light.turned) share /= all;
    // -0 is 0.
    for (float& value : values) value += 0.0f;
    light.hash = hash_bytes(std::as_bytes(std::span(values)));
    light.values = std::move(values);
    BokehKernel image(std::move(file));
    image.light_ = std::make_shared<const Distribution>(std::move(light));
    return image;
}

uint64_t BokehKernel::hash() const {
    return light_->hash;
}

const std::vector<float>& BokehKernel::values() const {
    return light_->values;
}

std::array<double, 2> BokehKernel::point(double within, double turn) const {
    const double direction = place_of(turn - std::floor(turn), light_->turned);
    const double angle = kStep * direction;
    const double place = place_of(within, light_->within[size_t(direction)]);
    // Even over the ring's area.
    const double ring = std::floor(place);
    const double inner = ring / kRings, outer = (ring + 1) / kRings;
    const double radius =
        std::sqrt(inner * inner + (place - ring) * (outer * outer - inner * inner));
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

bool BokehKernel::operator==(const BokehKernel& other) const {
    if (is_read() != other.is_read()) return false;
    if (!is_read()) return file_ == other.file_;
    return light_ == other.light_ || light_->values == other.light_->values;
}

}  // namespace postchain
