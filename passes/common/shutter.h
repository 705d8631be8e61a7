// The shutter parameters of a pass.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/frame/frame.h"
#include "chain/frame/origin.h"

namespace postchain::shutter {

struct Parameters {
    std::optional<double> shutter_frames;
    std::optional<double> shutter_angle_deg;
    std::optional<double> max_blur_fraction;  // instead of the pass's max_blur_px
};

// Rows for the table of a pass that has a shutter.
const ParameterTable& parameter_table();

// Time the shutter is open, in frames: the pass's own value (frames, or degrees / 360), otherwise
// the camera's, otherwise kDefaultShutterFrames.
double open_frames(const Parameters& parameters, const Camera& camera);
inline constexpr double kFrameDeg = 360;  // a shutter angle that is open for one frame

// The times at which the shutter opens and closes, frames from the frame's own.
struct Interval {
    double opens = -0.25, closes = 0.25;

    // The longer side of the frame's time: half the open time if the shutter is centered.
    double longer_side() const { return std::max(-opens, closes); }
};
Interval interval(const Parameters& parameters, const Camera& camera);

// The open time, and the longest streak on this frame, unclamped, if its speeds are known.
std::vector<UsedValue> used_values(const Parameters& parameters, const FrameDescription& frame);

// The longest half-length of a streak that the user sets, in pixels or as a fraction of the
// display's height; empty: neither.
std::optional<double> limit_px(const Parameters& parameters, std::optional<int> max_blur_px,
                               const FrameDescription& frame);

// The limit, with this value, if half of the frame's longest streak exceeds it.
std::vector<ExceededLimit> exceeded_limits(const Parameters& parameters,
                                           const FrameDescription& frame, double max_half_px);

}  // namespace postchain::shutter
