#include "passes/common/lens.h"

namespace postchain::lens {

const ParameterTable& parameter_table() {
    const ReadIf lens = {{{"coc", {"lens"}}}};
    const ReadIf planes = {{{"coc", {"planes"}}}};
    const ReadIf range = {{{"coc", {"range"}}}};
    const ReadIf focus = {{{"coc", {"lens"}}}, {{"coc", {"range"}}, {"focus", {"unset"}}}};
    static const ParameterTable rows =
        ParameterTableBuilder<Parameters>()
            .choice("coc", &Parameters::coc, {"lens", "planes", "range"},
                    {.help = "source of the circle of confusion: a thin lens, four planes, or one "
                             "range around the focus"})
            .number("focal_length_mm", &Parameters::focal_length_mm,
                    {.min = 0,
                     .max = 1e6,
                     .min_excluded = true,
                     .soft_min = 5,
                     .soft_max = 200,
                     .unit = "mm",
                     .help = "focal length",
                     .unset_means = "the camera's",
                     .read_if = lens})
            .number("f_stop", &Parameters::f_stop,
                    {.min = 0,
                     .min_excluded = true,
                     .soft_min = 0.05,
                     .soft_max = 32,
                     .help = "focal length over the diameter of the aperture",
                     .unset_means = "the camera's",
                     .read_if = lens})
            .number("focus_distance", &Parameters::focus_distance,
                    {.min = 0,
                     .max = kMaxDistance,
                     .min_excluded = true,
                     .soft_min = 0.5,
                     .soft_max = 60,
                     .unit = "scene units",
                     .help = "distance of the plane in focus, beyond the focal length",
                     .unset_means = "the camera's",
                     .read_if = focus})
            .point("focus_at", &Parameters::focus_at,
                   {.min = 0,
                    .max = 1,
                    .unit = "display sizes",
                    .help = "place in each frame, from the top left, whose "
                            "surface is in focus",
                    .unset_means = "focus_distance decides",
                    .excludes = "focus_distance",
                    .read_if = focus})
            .number("sensor_width_mm", &Parameters::sensor_width_mm,
                    {.min = 0,
                     .min_excluded = true,
                     .soft_min = 10,
                     .soft_max = 50,
                     .unit = "mm",
                     .help = "sensor width that the display width covers",
                     .unset_means = "the camera's",
                     .read_if = lens})
            .boolean(
                "breathing", &Parameters::breathing,
                {.help = "refocus as a thin lens does: radii times s/(s - f)", .read_if = lens})
            .number("near_blurry", &Parameters::near_blurry,
                    {.min = 0,
                     .max = kMaxDistance,
                     .soft_min = 0.01,
                     .soft_max = 20,
                     .unit = "scene units",
                     .help = "at this distance and closer the near blur is largest",
                     .read_if = planes})
            .number("near_sharp", &Parameters::near_sharp,
                    {.min = 0,
                     .max = kMaxDistance,
                     .soft_min = 0.01,
                     .soft_max = 20,
                     .unit = "scene units",
                     .help = "the near blur begins closer than this distance",
                     .read_if = planes})
            .number("far_sharp", &Parameters::far_sharp,
                    {.min = 0,
                     .max = kMaxDistance,
                     .soft_min = 0.01,
                     .soft_max = 100,
                     .unit = "scene units",
                     .help = "the far blur begins beyond this distance",
                     .read_if = planes})
            .number("far_blurry", &Parameters::far_blurry,
                    {.min = 0,
                     .max = kMaxDistance,
                     .soft_min = 0.01,
                     .soft_max = 100,
                     .unit = "scene units",
                     .help = "at this distance and beyond the far blur is largest",
                     .read_if = planes})
            .number("max_near_fraction", &Parameters::max_near_fraction,
                    {.min = 0,
                     .max = 1,
                     .soft_max = 0.2,
                     .unit = "display widths",
                     .help = "largest near radius",
                     .read_if = planes})
            .number("max_far_fraction", &Parameters::max_far_fraction,
                    {.min = 0,
                     .max = 1,
                     .soft_max = 0.2,
                     .unit = "display widths",
                     .help = "largest far radius",
                     .read_if = planes})
            .number("focus", &Parameters::focus,
                    {.min = 0,
                     .max = kMaxDistance,
                     .min_excluded = true,
                     .soft_min = 0.5,
                     .soft_max = 60,
                     .unit = "scene units",
                     .help = "distance of the plane in focus",
                     .unset_means = "focus_distance, the pass's or the camera's",
                     .read_if = range})
            .number("range", &Parameters::range,
                    {.min = 0,
                     .max = kMaxDistance,
                     .min_excluded = true,
                     .soft_min = 0.1,
                     .soft_max = 50,
                     .unit = "scene units",
                     .help = "distance from the focus at which the radius is "
                             "max_radius_px",
                     .read_if = range})
            .number("max_radius_px", &Parameters::max_radius_px,
                    {.min = 0,
                     .max = 1000,
                     .soft_max = 30,
                     .unit = "px",
                     .help = "largest radius of the circle of confusion",
                     .unset_means = "an eighth of the display width, at most 512; coc: range, "
                                    "method: gilham: 3 % of it"})
            .number("max_radius_fraction", &Parameters::max_radius_fraction,
                    {.min = 0,
                     .max = 1,
                     .soft_max = 0.1,
                     .unit = "display heights",
                     .help = "largest radius, the same part of images of every size",
                     .unset_means = "max_radius_px decides",
                     .excludes = "max_radius_px"})
            .table();
    return rows;
}

}  // namespace postchain::lens
