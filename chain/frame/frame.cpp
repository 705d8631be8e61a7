#include "chain/frame/frame.h"

#include <algorithm>

#include "chain/frame/behind.h"

namespace postchain {

const char* name_of(Precision precision) {
    return precision == Precision::fp16 ? "fp16" : "fp32";
}

int stacked_planes(Role role, const FrameDescription& frame) {
    if (!is_stacked(role)) return 0;
    if (role == Role::layers || role == Role::layers_before || role == Role::layers_after)
        return frame.layers;
    if (role == Role::behind) return kBehindPlanes + frame.layers;
    int most = -1;
    for (const int index : frame.mattes) most = std::max(most, index);
    return most + 1;
}

Camera Camera::overlaid_by(const Camera& over) const {
    Camera result = *this;
    if (over.aperture_image) {
        result.aperture_blades.reset();
        result.aperture_curvature.reset();
    } else if (over.aperture_blades || over.aperture_curvature) {
        result.aperture_image = {};
    }
    const auto lay = [](auto& under, const auto& value) {
        if (value) under = value;
    };
    lay(result.focal_length_mm, over.focal_length_mm);
    lay(result.sensor_width_mm, over.sensor_width_mm);
    lay(result.f_stop, over.f_stop);
    lay(result.focus_distance, over.focus_distance);
    if (over.focus_distance) result.metadata_focus_m = over.metadata_focus_m;
    lay(result.near_clip, over.near_clip);
    lay(result.far_clip, over.far_clip);
    lay(result.shutter_frames, over.shutter_frames);
    lay(result.shutter_position, over.shutter_position);
    lay(result.meters_per_unit, over.meters_per_unit);
    lay(result.aperture_blades, over.aperture_blades);
    lay(result.aperture_image, over.aperture_image);
    lay(result.aperture_rotation_deg, over.aperture_rotation_deg);
    lay(result.aperture_curvature, over.aperture_curvature);
    lay(result.aperture_ratio, over.aperture_ratio);
    lay(result.cats_eye, over.cats_eye);
    if (result.metadata_focus_m)
        result.focus_distance =
            *result.metadata_focus_m / result.meters_per_unit.value_or(kDefaultMetersPerUnit);
    return result;
}

std::string Camera::text() const {
    Camera named = *this;
    if (aperture_image.is_read()) named.aperture_image = BokehKernel(hex_of(aperture_image.hash()));
    std::string text = camera_parameters().text(&named);
    // As yet without the unit that makes it a distance.
    if (metadata_focus_m) text += " metadata_focus_m=" + text_of(*metadata_focus_m);
    return text;
}

const ParameterTable& camera_parameters() {
    static const std::string metadata = "from {camera} or the file's metadata"_keyed;
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
                     .help = "time the shutter is open",
                     .unset_means = "from {camera}, otherwise 0.5"_keyed})
            .choice("shutter_position", &Camera::shutter_position, shutter_position_names(),
                    {.help = "the shutter opens at the frame, is centered on it, or closes at it",
                     .unset_means = "from {camera}, otherwise center"_keyed})
            .number(
                "meters_per_unit", &Camera::meters_per_unit,
                {.min = 0,
                 .min_excluded = true,
                 .unit = "m",
                 .help = "length of one scene unit; depth and focus distance are in scene units",
                 .unset_means = "from {camera}, otherwise 1"_keyed})
            .integer("aperture_blades", &Camera::aperture_blades,
                     {.min = 0,
                      .max = 16,
                      .help = "blades of the aperture; below 3: a disc",
                      .unset_means = "from {camera}, otherwise a disc"_keyed,
                      .excludes = "aperture_image"})
            .file(
                "aperture_image", &Camera::aperture_image,
                {.unit = "FILE",
                 .help = "bokeh kernel: a square image of the light that passes each point of the "
                         "aperture",
                 .unset_means = "from {camera}, otherwise blades or a disc"_keyed})
            .number(
                "aperture_rotation_deg", &Camera::aperture_rotation_deg,
                {.min = -360,
                 .max = 360,
                 .unit = "degrees",
                 .help = "turns the aperture counterclockwise; at 0 the first corner of the blades "
                         "is 180/blades above the right, as in Cycles",
                 .unset_means = "from {camera}, otherwise 0"_keyed})
            .number("aperture_curvature", &Camera::aperture_curvature,
                    {.min = 0,
                     .max = 1,
                     .help = "curvature of the blades: 0 straight, 1 a disc",
                     .unset_means = "from {camera}, otherwise 0"_keyed,
                     .excludes = "aperture_image"})
            .number("aperture_ratio", &Camera::aperture_ratio,
                    {.min = 0.1,
                     .max = 10,
                     .help = "height over width of the aperture; above 1: the tall discs of an "
                             "anamorphic lens, as in Cycles",
                     .unset_means = "from {camera}, otherwise 1"_keyed})
            .number("cats_eye", &Camera::cats_eye,
                    {.min = 0,
                     .max = 1,
                     .unit = "radii",
                     .help = "how far the lens barrel cuts the aperture in the corners of the "
                             "frame; 0: not cut",
                     .unset_means = "from {camera}, otherwise 0"_keyed})
            .table();
    return table;
}

}  // namespace postchain
