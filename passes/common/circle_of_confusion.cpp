#include "passes/common/circle_of_confusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace postchain::lens {
namespace {

// Relative error of the few fp32 operations between a depth and its radius: the inputs' rounding
// and at most four operations, each 2^-24; doubled.
constexpr double kGpuRelativeError = 10.0 / 16777216.0;

// fp32 must hold the gain; |R| reaches max_radius_px long before it matters.
constexpr double kMaxGain = 1e30;

// `keys`: "f_stop, focus_distance".
Status not_known(const std::string& keys, bool several, const FrameDescription& frame) {
    const char* it = several ? "them" : "it";
    return Status(StatusCode::chain,
                  concat(keys, ": not known, and this circle of confusion needs ", it, "; set ", it,
                         " here, in the chain's camera, ", frame.camera_place));
}

// The display's width in shorter sides of a pixel.
double lens_width(const FrameDescription& frame) {
    return frame.display_width / pixel_axes(frame)[0];
}

// One value of the lens: the pass's own or the camera's, > 0, or the reason why not.
Result<double> lens_value(const char* key, const char* unit, const std::optional<double>& own,
                          const std::optional<double>& camera, const FrameDescription& frame) {
    const auto& value = own ? own : camera;
    if (!value) return not_known(key, false, frame);
    if (!(*value > 0))
        return Status(StatusCode::chain,
                      concat(key, ": ", *value, unit, " from ", own ? "this pass" : "the camera",
                             " is not > 0; set a positive value here or in the camera"));
    return *value;
}

// Scene units, infinite if the sky is in focus.
Result<double> focus_distance(const char* key, const std::optional<double>& own,
                              const Parameters& p, const FrameDescription& frame) {
    if (own || !p.focus_at)
        return lens_value(key, " scene units", own, frame.camera.focus_distance, frame);
    const auto& depths = frame.bounds.inverse_depth_at;
    const auto found = depths.find(*p.focus_at);
    if (found == depths.end())
        return Status(StatusCode::chain,
                      concat("focus_at: the depth at ", text_of(ParameterValue(*p.focus_at)),
                             " is not known, because no depth was read on the CPU; set "
                             "focus_distance instead"));
    return 1 / found->second;
}

Status check_ascending(const char* low_key, double low, const char* high_key, double high,
                       bool equal_allowed) {
    if (equal_allowed ? low <= high : low < high) return Status();
    return Status(
        StatusCode::chain,
        concat(low_key, ": ", low, " is not ", equal_allowed ? "<= " : "< ", high_key, " (", high,
               "); the planes must be in the order near_blurry < near_sharp <= far_sharp < "
               "far_blurry, in scene units"));
}

// An error that names all values of the thin lens that are not known.
Status all_known(const Parameters& p, const FrameDescription& frame) {
    const Camera& camera = frame.camera;
    std::string keys;
    int count = 0;
    const auto need = [&](const char* key, bool known) {
        if (known) return;
        keys += (count++ ? ", " : "") + std::string(key);
    };
    need("focal_length_mm", p.focal_length_mm || camera.focal_length_mm);
    need("f_stop", p.f_stop || camera.f_stop);
    need("focus_distance", p.focus_distance || p.focus_at || camera.focus_distance);
    need("sensor_width_mm", p.sensor_width_mm || camera.sensor_width_mm);
    return count ? not_known(keys, count > 1, frame) : Status();
}

Status resolve_lens(const Parameters& p, const FrameDescription& frame, CircleOfConfusion& coc) {
    const Camera& camera = frame.camera;
    RETURN_IF_ERROR(all_known(p, frame));
    ASSIGN_OR_RETURN(const auto focal, lens_value("focal_length_mm", " mm", p.focal_length_mm,
                                                  camera.focal_length_mm, frame));
    ASSIGN_OR_RETURN(const auto f_stop, lens_value("f_stop", "", p.f_stop, camera.f_stop, frame));
    ASSIGN_OR_RETURN(const auto focus,
                     focus_distance("focus_distance", p.focus_distance, p, frame));
    ASSIGN_OR_RETURN(const auto sensor, lens_value("sensor_width_mm", " mm", p.sensor_width_mm,
                                                   camera.sensor_width_mm, frame));
    const double meters_per_unit = camera.meters_per_unit.value_or(kDefaultMetersPerUnit);
    if (!(meters_per_unit > 0))
        return Status(StatusCode::chain, concat("meters_per_unit: ", meters_per_unit,
                                                " from the camera is not > 0; correct the camera"));

    const double f = focal / 1000 / meters_per_unit;  // scene units
    const double s = focus;
    if (!(s > f))
        return Status(
            StatusCode::chain,
            concat("focus_distance: ", s, " scene units is not beyond the focal length (", focal,
                   " mm = ", f, " scene units at ", meters_per_unit,
                   " m per unit); focus farther away, or correct focal_length_mm or the camera's "
                   "meters_per_unit"));
    const double f_px = focal * lens_width(frame) / sensor;
    coc.lens = true;
    coc.gain_px = 0.5 * f_px * (f / f_stop);
    if (p.breathing) coc.gain_px /= 1 - f / s;
    coc.gain_px = std::min(coc.gain_px, kMaxGain);
    coc.focus_inverse = 1 / s;
    coc.focal_inverse = 1 / f;
    return Status();
}

Status resolve_planes(const Parameters& p, const FrameDescription& frame, CircleOfConfusion& coc) {
    for (const Status& status :
         {check_ascending("near_blurry", p.near_blurry, "near_sharp", p.near_sharp, false),
          check_ascending("near_sharp", p.near_sharp, "far_sharp", p.far_sharp, true),
          check_ascending("far_sharp", p.far_sharp, "far_blurry", p.far_blurry, false)})
        if (!status.ok()) return status;
    coc.lens = false;
    coc.near_sharp = p.near_sharp;
    coc.near_span = p.near_sharp - p.near_blurry;
    coc.far_sharp = p.far_sharp;
    coc.far_span = p.far_blurry - p.far_sharp;
    coc.near_radius_px = p.max_near_fraction * lens_width(frame);
    coc.far_radius_px = p.max_far_fraction * lens_width(frame);
    return Status();
}

Status resolve_range(const Parameters& p, const FrameDescription& frame, CircleOfConfusion& coc) {
    ASSIGN_OR_RETURN(const auto focus,
                     focus_distance("focus", p.focus ? p.focus : p.focus_distance, p, frame));
    if (!(p.range > 0))
        return Status(StatusCode::chain,
                      concat("range: ", p.range, " scene units is not > 0; set a positive value"));
    coc.lens = false;
    coc.near_sharp = coc.far_sharp = focus;
    coc.near_span = coc.far_span = p.range;
    coc.near_radius_px = coc.far_radius_px = coc.max_radius_px;
    if (std::isinf(focus)) {  // nothing is behind the sky
        coc.near_sharp = coc.far_sharp = kMaxDistance;
        coc.far_radius_px = 0;
    }
    return Status();
}

// Inverse depths between which |R| is at most `radius` without max_radius_px: {far limit, near
// limit}; 0 is infinitely far, infinite is at the camera.
std::array<double, 2> depths_within(const CircleOfConfusion& coc, double radius) {
    constexpr double kNoLimit = std::numeric_limits<double>::infinity();
    if (coc.lens) {
        if (coc.gain_px == 0) return {0, kNoLimit};
        const double reach = radius / coc.gain_px;
        return {std::max(0.0, coc.focus_inverse - reach), coc.focus_inverse + reach};
    }
    const double near_limit = coc.near_radius_px > radius
                                  ? coc.near_sharp - coc.near_span * radius / coc.near_radius_px
                                  : 0;
    const double far_limit = coc.far_radius_px > radius
                                 ? coc.far_sharp + coc.far_span * radius / coc.far_radius_px
                                 : kNoLimit;
    return {1 / far_limit, near_limit > 0 ? 1 / near_limit : kNoLimit};
}

}  // namespace

double CircleOfConfusion::largest_unclamped_radius_px(double w_min, double w_max) const {
    CircleOfConfusion unclamped = *this;
    unclamped.max_radius_px = std::numeric_limits<double>::infinity();
    return std::max(std::abs(unclamped.radius_px(w_min)), std::abs(unclamped.radius_px(w_max)));
}

double CircleOfConfusion::radius_px(double w) const {
    if (!(w > 0)) w = 0;
    if (lens) {
        if (gain_px == 0) return 0;
        return std::clamp(gain_px * (focus_inverse - w), -max_radius_px, max_radius_px);
    }
    const double d = 1 / w;  // infinite for the sky: the far ramp's end
    const double near_part = std::clamp((near_sharp - d) / near_span, 0.0, 1.0);
    const double far_part = std::clamp((d - far_sharp) / far_span, 0.0, 1.0);
    return std::clamp(far_radius_px * far_part - near_radius_px * near_part, -max_radius_px,
                      max_radius_px);
}

double CircleOfConfusion::largest_radius_px(double w_min, double w_max) const {
    double largest = 0;
    for (const double w : {w_min, w_max}) {
        if (lens) {
            if (gain_px == 0) continue;
            const double error = kGpuRelativeError * (focus_inverse + w);
            largest = std::max(largest, gain_px * (std::abs(focus_inverse - w) + error));
        } else {
            // The ramps with everything rounded in their favor.
            const double d = 1 / w;
            const bool sky = std::isinf(d);
            const double near_part =
                sky ? 0 : (near_sharp - d + kGpuRelativeError * (near_sharp + d)) / near_span;
            const double far_part =
                sky ? 1 : (d - far_sharp + kGpuRelativeError * (far_sharp + d)) / far_span;
            largest = std::max({largest, near_radius_px * std::clamp(near_part, 0.0, 1.0),
                                far_radius_px * std::clamp(far_part, 0.0, 1.0)});
        }
    }
    return std::min(largest * (1 + kGpuRelativeError), largest_radius_px());
}

double CircleOfConfusion::largest_radius_px() const {
    if (lens) return gain_px == 0 ? 0 : max_radius_px;
    return std::min(std::max(near_radius_px, far_radius_px), max_radius_px);
}

double CircleOfConfusion::typical_radius_px() const {
    return std::max(std::abs(radius_px(0)),
                    std::abs(radius_px(focal_inverse / kTypicalFocalLengths)));
}

std::array<double, 2> pixel_axes(const FrameDescription& frame) {
    const double aspect = frame.pixel_aspect;
    return {std::min(1 / aspect, 1.0), std::min(aspect, 1.0)};
}

std::vector<ExceededLimit> exceeded_limits(const CircleOfConfusion& coc,
                                           const FrameDescription& frame) {
    const FrameBounds& bounds = frame.bounds;
    if (!std::isfinite(bounds.max_inverse_depth)) return {};
    const double largest =
        coc.largest_unclamped_radius_px(bounds.min_inverse_depth, bounds.max_inverse_depth);
    if (largest <= coc.max_radius_px) return {};
    const auto [low, high] = depths_within(coc, coc.max_radius_px);
    return {{coc.limit,
             "radius of the circle of confusion",
             coc.max_radius_px,
             largest,
             {Role::inverse_depth},
             low,
             high}};
}

double max_radius_px(const Parameters& parameters, const FrameDescription& frame,
                     double unset_fraction) {
    const bool range = parameters.coc == CocSource::range;
    const double fraction = range ? kSmallMaxRadiusFraction : unset_fraction;
    // The small fraction sets a blur's width and is not clamped.
    const double most = fraction > kSmallMaxRadiusFraction ? kMaxRadiusPx : HUGE_VAL;
    if (parameters.max_radius_fraction)
        return *parameters.max_radius_fraction * frame.display_height / pixel_axes(frame)[1];
    return parameters.max_radius_px.value_or(std::min(fraction * lens_width(frame), most));
}

std::vector<Place> depth_places(const Parameters& parameters) {
    const bool used = parameters.focus_at && parameters.coc != CocSource::planes &&
                      !(parameters.coc == CocSource::range && parameters.focus);
    return used ? std::vector<Place>{*parameters.focus_at} : std::vector<Place>{};
}

Result<CircleOfConfusion> circle_of_confusion(const Parameters& parameters,
                                              const FrameDescription& frame,
                                              double unset_fraction) {
    CircleOfConfusion coc;
    coc.max_radius_px = max_radius_px(parameters, frame, unset_fraction);
    if (parameters.max_radius_fraction) coc.limit = "max_radius_fraction";
    coc.axes = pixel_axes(frame);
    Status status;
    switch (parameters.coc) {
        case CocSource::lens:
            status = resolve_lens(parameters, frame, coc);
            break;
        case CocSource::planes:
            status = resolve_planes(parameters, frame, coc);
            break;
        case CocSource::range:
            status = resolve_range(parameters, frame, coc);
            break;
    }
    if (!status.ok()) return status;
    return coc;
}

CircleOfConfusion any_circle_of_confusion(const Parameters& parameters) {
    CircleOfConfusion coc;
    coc.lens = parameters.coc == CocSource::lens;
    return coc;
}

std::vector<UsedValue> used_values(const Parameters& p, const CircleOfConfusion& coc,
                                   const FrameDescription& frame, double sharp_radius_px) {
    using Of = UsedValue::Of;
    const Camera& camera = frame.camera;
    std::vector<UsedValue> values;
    const auto add = [&](const char* key, const char* unit, const std::optional<double>& own,
                         const std::optional<double>& of_camera) {
        if (own || of_camera)
            values.push_back({key, own ? *own : *of_camera, unit, own ? Of::pass : Of::camera});
    };
    const auto add_focus = [&](const char* key, const std::optional<double>& own) {
        if (own || !p.focus_at) return add(key, "scene units", own, camera.focus_distance);
        const double w = frame.bounds.inverse_depth_at.at(*p.focus_at);
        values.push_back({key, w > 0 ? ParameterValue(1 / w) : ParameterValue(), "scene units",
                          Of::pass, "focus_at"});
    };
    if (p.coc == CocSource::lens) {
        add("focal_length_mm", "mm", p.focal_length_mm, camera.focal_length_mm);
        add("sensor_width_mm", "mm", p.sensor_width_mm, camera.sensor_width_mm);
        add("f_stop", "", p.f_stop, camera.f_stop);
        add_focus("focus_distance", p.focus_distance);
        values.push_back({"meters_per_unit", camera.meters_per_unit.value_or(kDefaultMetersPerUnit),
                          "m", camera.meters_per_unit ? Of::camera : Of::standard});
    } else if (p.coc == CocSource::range) {
        const bool from_focus = p.focus.has_value();
        add_focus("focus", from_focus ? p.focus : p.focus_distance);
        if (!from_focus)
            values.back().row = p.focus_at && !p.focus_distance ? "focus_at" : "focus_distance";
    }
    const bool own = p.max_radius_px || p.max_radius_fraction;
    values.push_back(
        {"max_radius_px", coc.max_radius_px, "px", own ? Of::pass : Of::standard, coc.limit});
    const FrameBounds& bounds = frame.bounds;
    if (std::isfinite(bounds.max_inverse_depth))
        values.push_back({"largest_circle_px",
                          2 * coc.largest_unclamped_radius_px(bounds.min_inverse_depth,
                                                              bounds.max_inverse_depth),
                          "px", Of::frame});
    const auto [far_w, near_w] =
        coc.max_radius_px <= sharp_radius_px
            ? std::array<double, 2>{0, std::numeric_limits<double>::infinity()}
            : depths_within(coc, sharp_radius_px);
    values.push_back({"sharp_from", 1 / near_w, "scene units", Of::frame});
    values.push_back({"sharp_to", far_w > 0 ? ParameterValue(1 / far_w) : ParameterValue(),
                      "scene units", Of::frame});
    values.push_back({"sharp_circle_px", 2 * sharp_radius_px, "px", Of::standard});
    return values;
}

}  // namespace postchain::lens
