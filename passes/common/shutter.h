// The shutter parameters of a pass.
#pragma once

#include <optional>
#include <vector>

#include "chain/frame.h"
#include "chain/origin.h"
#include "chain/parameter.h"

namespace postchain::shutter {

struct Parameters {
    std::optional<double> shutter_frames;
    std::optional<double> shutter_angle_deg;
};

// Rows for the table of a pass that has a shutter.
const ParameterTable& parameter_table();

// Time the shutter is open, in frames: the pass's own value (frames, or degrees / 360), otherwise
// the camera's, otherwise kDefaultShutterFrames.
double open_frames(const Parameters& parameters, const Camera& camera);

// The open time, and the longest streak on this frame, uncut, if its speeds are known.
std::vector<UsedValue> used_values(const Parameters& parameters, const FrameDescription& frame);

// max_blur_px, with this value, if half of the frame's longest streak exceeds it.
std::vector<Cut> cuts(const Parameters& parameters, const FrameDescription& frame,
                      double max_half_px);

}  // namespace postchain::shutter
