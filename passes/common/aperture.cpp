#include "passes/common/aperture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace postchain::lens {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kHalfBladeSteps = 256;  // steps of half a blade

bool is_disc(const Aperture& aperture) {
    return aperture.blades < 3 || aperture.curvature == 1;
}

}  // namespace

const ParameterTable& aperture_parameter_table() {
    using P = ApertureParameters;
    const char* camera = "the camera's, otherwise 0";
    // A disc has neither. An unset number of blades is the camera's.
    const RowValue blades = {"aperture_blades", {"0", "1", "2"}, true};
    static const ParameterTable rows =
        ParameterTableBuilder<P>()
            .integer("aperture_blades", &P::aperture_blades,
                     {.min = 0,
                      .max = 16,
                      .help = "blades of the aperture; below 3: a disc",
                      .unset_means = "the camera's, or its aperture_image, otherwise 0",
                      .excludes = "aperture_image"})
            .number("aperture_rotation_deg", &P::aperture_rotation_deg,
                    {.min = -360,
                     .max = 360,
                     .unit = "degrees",
                     .help = "turns the aperture counterclockwise, as seen in highlights behind "
                             "the focus",
                     .unset_means = camera,
                     .read_if = {{blades, {"aperture_curvature", {"1"}, true}}}})
            .number("aperture_curvature", &P::aperture_curvature,
                    {.min = 0,
                     .max = 1,
                     .help = "curvature of the blades: 0 straight, 1 a disc",
                     .unset_means = camera,
                     .excludes = "aperture_image",
                     .read_if = {{blades}}})
            .number("aperture_ratio", &P::aperture_ratio,
                    {.min = 0.1,
                     .max = 10,
                     .soft_min = 0.5,
                     .soft_max = 2,
                     .help = "height over width of the aperture; above 1: the tall "
                             "discs of an anamorphic lens",
                     .unset_means = "the camera's, otherwise 1"})
            .number("cats_eye", &P::cats_eye,
                    {.min = 0,
                     .max = 1,
                     .unit = "radii",
                     .help = "how far the lens barrel cuts the aperture in the corners of the "
                             "frame; 0: not cut",
                     .unset_means = camera})
            .table();
    return rows;
}

std::array<double, 2> Aperture::half_size() const {
    return {axes[0] * std::min(1 / ratio, 1.0), axes[1] * std::min(ratio, 1.0)};
}

Status check_aperture(const ApertureParameters& own, const Camera& camera) {
    if (!camera.aperture_image) return Status();
    const auto refuse = [&](const char* key, auto pass, auto cameras) {
        const std::string& file = camera.aperture_image.file();
        const std::string picture =
            concat("the camera's aperture_image", file.empty() ? "" : " (" + file + ")");
        return Status(StatusCode::chain, concat(key, ": ", pass ? *pass : *cameras, " from ",
                                                pass ? "this pass" : "the camera", " and ", picture,
                                                " are two shapes of one aperture; leave one out"));
    };
    if (own.aperture_blades || camera.aperture_blades)
        return refuse("aperture_blades", own.aperture_blades, camera.aperture_blades);
    if (own.aperture_curvature || camera.aperture_curvature)
        return refuse("aperture_curvature", own.aperture_curvature, camera.aperture_curvature);
    if (!camera.aperture_image.is_read())
        return Status(StatusCode::chain,
                      concat("aperture_image: ", camera.aperture_image.file(),
                             " has not been read; a host reads it and hands over its values "
                             "(chain/frame/bokeh_kernel.h)"));
    return Status();
}

Aperture aperture_of(const ApertureParameters& own, const Camera& camera,
                     std::array<double, 2> axes) {
    const auto value = [](const auto& first, const auto& second, auto otherwise) {
        return first ? *first : second.value_or(otherwise);
    };
    Aperture aperture;
    aperture.blades = value(own.aperture_blades, camera.aperture_blades, 0);
    aperture.image = camera.aperture_image;
    aperture.rotation_deg = value(own.aperture_rotation_deg, camera.aperture_rotation_deg, 0.0);
    aperture.curvature = value(own.aperture_curvature, camera.aperture_curvature, 0.0);
    aperture.ratio = value(own.aperture_ratio, camera.aperture_ratio, 1.0);
    aperture.cats_eye = value(own.cats_eye, camera.cats_eye, 0.0);
    aperture.axes = axes;
    return aperture;
}

std::vector<UsedValue> used_values(const ApertureParameters& own, const Camera& camera) {
    using Of = UsedValue::Of;
    std::vector<UsedValue> values;
    const auto add = [&](const char* key, const char* unit, const auto& first, const auto& second,
                         ParameterValue otherwise) {
        if (first || second) otherwise = first ? ParameterValue(*first) : ParameterValue(*second);
        values.push_back({key, otherwise, unit,
                          first    ? Of::pass
                          : second ? Of::camera
                                   : Of::standard});
    };
    const auto blades = [](const std::optional<int>& n) {
        return n ? std::optional<int64_t>(*n) : std::nullopt;
    };
    if (camera.aperture_image) {
        values.push_back({"aperture_image", camera.aperture_image.file(), "", Of::camera});
    } else {
        add("aperture_blades", "", blades(own.aperture_blades), blades(camera.aperture_blades),
            int64_t(0));
        add("aperture_curvature", "", own.aperture_curvature, camera.aperture_curvature, 0.0);
    }
    add("aperture_rotation_deg", "degrees", own.aperture_rotation_deg, camera.aperture_rotation_deg,
        0.0);
    add("aperture_ratio", "", own.aperture_ratio, camera.aperture_ratio, 1.0);
    add("cats_eye", "radii", own.cats_eye, camera.cats_eye, 0.0);
    return values;
}

uint64_t hash_of(const Aperture& aperture) {
    uint64_t hash = aperture.image ? aperture.image.hash() : uint64_t(aperture.blades);
    for (const double value : {aperture.rotation_deg, aperture.curvature, aperture.ratio,
                               aperture.cats_eye, aperture.axes[0], aperture.axes[1]}) {
        hash ^= std::bit_cast<uint64_t>(value);
        hash *= 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    return hash;
}

double barrel_per_px(const Aperture& aperture, const FrameDescription& frame) {
    const double corner_px = 0.5 * std::hypot(frame.display_width / aperture.axes[0],
                                              frame.display_height / aperture.axes[1]);
    return aperture.cats_eye / std::max(corner_px, 1.0);
}

// r e(angle) on the circle of radius 1/c through the corners e(+-pi/n). With b the distance of its
// center from the aperture's, times c, away from the blade: c r^2 + 2 b cos(angle) r = 2 b
// cos(pi/n) + c.
double blade_radius(int blades, double curvature, double angle) {
    const double c = curvature;
    const double cosine = std::cos(kPi / blades), sine = std::sin(kPi / blades);
    const double b = std::sqrt(1 - c * c * sine * sine) - c * cosine;
    const double right = 2 * b * cosine + c;
    const double across = b * std::cos(angle);
    return right / (across + std::sqrt(across * across + c * right));
}

std::optional<double> disc_radius(const Aperture& aperture) {
    const auto [width, height] = aperture.half_size();
    if (aperture.image || aperture.cats_eye > 0 || width != 1 || height != 1) return std::nullopt;
    if (is_disc(aperture)) return 1;
    // Both sums over half a blade, to its corner; few steps, as uniforms need them in each frame.
    constexpr int kSteps = 64;
    double squared = 0, fourth = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double angle = kPi / aperture.blades * (i + 0.5) / kSteps;
        const double radius = blade_radius(aperture.blades, aperture.curvature, angle);
        squared += radius * radius;
        fourth += radius * radius * radius * radius;
    }
    constexpr double kNearlyRound = 0.85;  // least radius, of six straight blades 0.866
    if (blade_radius(aperture.blades, aperture.curvature, 0) < kNearlyRound) return std::nullopt;
    return std::sqrt(fourth / squared);
}

Outline::Outline(const Aperture& aperture) : aperture_(aperture) {
    if (is_disc(aperture)) return;
    const double step = kPi / aperture.blades / kHalfBladeSteps;
    double sum = 0;
    swept_ = {0};
    for (int i = 0; i < kHalfBladeSteps; ++i) {
        const double radius = blade_radius(aperture.blades, aperture.curvature, (i + 0.5) * step);
        sum += radius * radius;
        swept_.push_back(sum);
    }
    for (double& swept : swept_) swept /= sum;
}

std::array<double, 2> Outline::at(double turn) const {
    const auto half_size = aperture_.half_size();
    if (is_disc(aperture_)) {
        const double angle = 2 * kPi * turn;
        return {half_size[0] * std::cos(angle), half_size[1] * std::sin(angle)};
    }
    const int blades = aperture_.blades;
    const double place = (turn - std::floor(turn)) * blades;
    const double blade = std::floor(place);
    // Position on this blade: its center is at 0, its corners at -1 and 1.
    const double side = 2 * (place - blade) - 1;
    const auto above = std::upper_bound(swept_.begin(), swept_.end() - 1, std::abs(side));
    const double low = *(above - 1), high = *above;
    const double steps = double(above - swept_.begin() - 1) + (std::abs(side) - low) / (high - low);
    const double from_middle = std::copysign(steps * kPi / blades / kHalfBladeSteps, side);
    const double radius = blade_radius(blades, aperture_.curvature, from_middle);
    const double angle =
        aperture_.rotation_deg * kPi / 180 + 2 * kPi * blade / blades + from_middle;
    return {half_size[0] * radius * std::cos(angle), -half_size[1] * radius * std::sin(angle)};
}

}  // namespace postchain::lens
