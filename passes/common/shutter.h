// The shutter, as a pass is told of it.
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

// Its rows, for the table of a pass that has a shutter.
const ParameterTable& parameter_table();

// Time the shutter is open, in frames: the pass's own value (frames, or degrees / 360), else the
// camera's, else kDefaultShutterFrames.
double open_frames(const Parameters& parameters, const Camera& camera);

// That, and the longest streak on this frame where its speeds are known. `max_half_px`: what half
// of a streak is cut to.
std::vector<UsedValue> used_values(const Parameters& parameters, const FrameDescription& frame,
                                   double max_half_px);

}  // namespace postchain::shutter
