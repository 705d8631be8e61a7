#include "passes/common/shutter.h"

namespace postchain::shutter {

const ParameterTable& parameter_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Parameters>()
            .number("shutter_frames", &Parameters::shutter_frames,
                    {.min = 0,
                     .max = 10,
                     .soft_max = 4,
                     .unit = "frames",
                     .help = "time the shutter is open, centered on the frame",
                     .unset_means = "the camera's shutter_frames, else 0.5",
                     .excludes = "shutter_angle_deg"})
            .number("shutter_angle_deg", &Parameters::shutter_angle_deg,
                    {.min = 0,
                     .max = 3600,
                     .soft_max = 1440,
                     .unit = "degrees",
                     .help = "the same as an angle: 360 degrees are one frame",
                     .unset_means = "shutter_frames decides",
                     .excludes = "shutter_frames"})
            .table();
    return table;
}

double open_frames(const Parameters& parameters, const Camera& camera) {
    if (parameters.shutter_frames) return *parameters.shutter_frames;
    if (parameters.shutter_angle_deg) return *parameters.shutter_angle_deg / 360.0;
    return camera.shutter_frames.value_or(kDefaultShutterFrames);
}

}  // namespace postchain::shutter
