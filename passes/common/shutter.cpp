#include "passes/common/shutter.h"

#include <algorithm>
#include <cmath>

namespace postchain::shutter {

const ParameterTable& parameter_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Parameters>()
            .number("shutter_frames", &Parameters::shutter_frames,
                    {.min = 0,
                     .max = 10,
                     .soft_max = 4,
                     .unit = "frames",
                     .help = "time the shutter is open",
                     .unset_means = "the camera's shutter_frames, otherwise 0.5",
                     .excludes = "shutter_angle_deg"})
            .number("shutter_angle_deg", &Parameters::shutter_angle_deg,
                    {.min = 0,
                     .max = 3600,
                     .soft_max = 1440,
                     .unit = "degrees",
                     .help = "open time as an angle: 360 degrees are one frame",
                     .unset_means = "shutter_frames decides",
                     .excludes = "shutter_frames"})
            .number("max_blur_fraction", &Parameters::max_blur_fraction,
                    {.min = 0.001,
                     .max = 1,
                     .soft_min = 0.01,
                     .soft_max = 0.25,
                     .unit = "display heights",
                     .help = "largest half-length of a streak, the same part of images of every "
                             "size (guertin, single: at least 8 px)",
                     .unset_means = "max_blur_px decides",
                     .excludes = "max_blur_px"})
            .table();
    return table;
}

double open_frames(const Parameters& parameters, const Camera& camera) {
    if (parameters.shutter_frames) return *parameters.shutter_frames;
    if (parameters.shutter_angle_deg) return *parameters.shutter_angle_deg / kFrameDeg;
    return camera.shutter_frames.value_or(kDefaultShutterFrames);
}

Interval interval(const Parameters& parameters, const Camera& camera) {
    const double open = open_frames(parameters, camera);
    switch (camera.shutter_position.value_or(ShutterPosition::center)) {
        case ShutterPosition::start:
            return {0, open};
        case ShutterPosition::center:
            return {-0.5 * open, 0.5 * open};
        case ShutterPosition::end:
            return {-open, 0};
    }
    return {};
}

std::optional<double> limit_px(const Parameters& parameters, std::optional<int> max_blur_px,
                               const FrameDescription& frame) {
    if (max_blur_px) return *max_blur_px;
    if (!parameters.max_blur_fraction) return {};
    return *parameters.max_blur_fraction * frame.display_height;
}

namespace {

// Largest length of the frame's motion vectors, px per frame; 0 at a camera cut.
double fastest_px(const FrameDescription& frame) {
    if (frame.bounds.camera_cut) return 0;
    return frame.bounds.fastest_px(frame.planes.has(Role::motion_back));
}

}  // namespace

std::vector<ExceededLimit> exceeded_limits(const Parameters& parameters,
                                           const FrameDescription& frame, double max_half_px) {
    const Interval open = interval(parameters, frame.camera);
    const double side = open.longer_side();
    const double fastest = fastest_px(frame);
    if (!std::isfinite(fastest) || side * fastest <= max_half_px) return {};
    return {{parameters.max_blur_fraction ? "max_blur_fraction" : "max_blur_px",
             open.opens == -open.closes ? "half-length of a streak" : "length of a streak",
             max_half_px,
             side * fastest,
             {Role::motion, Role::motion_back},
             0,
             max_half_px / side}};
}

std::vector<UsedValue> used_values(const Parameters& parameters, const FrameDescription& frame) {
    using Of = UsedValue::Of;
    const double open = open_frames(parameters, frame.camera);
    UsedValue shutter{"shutter_frames", open, "frames", Of::standard};
    if (parameters.shutter_frames || parameters.shutter_angle_deg)
        shutter.of = Of::pass;
    else if (frame.camera.shutter_frames)
        shutter.of = Of::camera;
    if (!parameters.shutter_frames && parameters.shutter_angle_deg)
        shutter.row = "shutter_angle_deg";
    std::vector<UsedValue> values = {shutter};
    const auto position = frame.camera.shutter_position.value_or(ShutterPosition::center);
    if (position != ShutterPosition::center)
        values.push_back(
            {"shutter_position", shutter_position_names()[size_t(position)], "", Of::camera});
    if (const double fastest = fastest_px(frame); std::isfinite(fastest))
        values.push_back({"longest_streak_px", open * fastest, "px", Of::frame});
    return values;
}

}  // namespace postchain::shutter
