#include "chain/frame.h"

namespace postchain {

const char* name_of(Precision precision) {
    return precision == Precision::fp16 ? "fp16" : "fp32";
}

Camera Camera::overlaid_by(const Camera& over) const {
    Camera result = *this;
    const auto lay = [](std::optional<double>& under, const std::optional<double>& value) {
        if (value) under = value;
    };
    lay(result.focal_length_mm, over.focal_length_mm);
    lay(result.sensor_width_mm, over.sensor_width_mm);
    lay(result.f_stop, over.f_stop);
    lay(result.focus_distance, over.focus_distance);
    lay(result.near_clip, over.near_clip);
    lay(result.far_clip, over.far_clip);
    lay(result.shutter_frames, over.shutter_frames);
    lay(result.meters_per_unit, over.meters_per_unit);
    return result;
}

const ParameterTable& camera_parameters() {
    const char* metadata = "from --camera or the file's metadata";
    static const ParameterTable table =
        ParameterTableBuilder<Camera>()
            .number("focal_length_mm", &Camera::focal_length_mm,
                    {.min = 0,
                     .min_excluded = true,
                     .unit = "mm",
                     .help = "focal length of the lens",
                     .unset_means = metadata})
            .number("sensor_width_mm", &Camera::sensor_width_mm,
                    {.min = 0,
                     .min_excluded = true,
                     .unit = "mm",
                     .help = "width of the sensor that the display width covers",
                     .unset_means = metadata})
            .number("f_stop", &Camera::f_stop,
                    {.min = 0,
                     .min_excluded = true,
                     .help = "focal length over the diameter of the aperture",
                     .unset_means = metadata})
            .number("focus_distance", &Camera::focus_distance,
                    {.min = 0,
                     .min_excluded = true,
                     .unit = "scene units",
                     .help = "distance of the plane in focus along the view axis",
                     .unset_means = metadata})
            .number("near_clip", &Camera::near_clip,
                    {.min = 0,
                     .unit = "scene units",
                     .help = "near clip plane of the depth buffer",
                     .unset_means = metadata})
            .number("far_clip", &Camera::far_clip,
                    {.min = 0,
                     .min_excluded = true,
                     .unit = "scene units",
                     .help = "far clip plane of the depth buffer",
                     .unset_means = metadata})
            .number("shutter_frames", &Camera::shutter_frames,
                    {.min = 0,
                     .max = 100,
                     .unit = "frames",
                     .help = "time the shutter is open, centered on the frame",
                     .unset_means = "from --camera, else 0.5"})
            .number(
                "meters_per_unit", &Camera::meters_per_unit,
                {.min = 0,
                 .min_excluded = true,
                 .unit = "m",
                 .help = "length of one scene unit; depth and focus distance are in scene units",
                 .unset_means = "from --camera, else 1"})
            .table();
    return table;
}

}  // namespace postchain
