// Classes of pixels by a frame's own planes, so that temporal error is measured apart in each.
#pragma once

#include <functional>

#include "chain/frame/frame.h"
#include "tools/metrics/temporal.h"

namespace postchain::experiment {

inline constexpr double kMovingPx = 1.0 / 16;   // per frame; slower pixels are still
inline constexpr double kDefocusedPx = 0.5;     // radius of the circle of confusion
inline constexpr double kDepthJump = 0.1;       // in parts of the largest inverse depth there
inline constexpr double kOutlineReachPx = 2.0;  // of a jump, besides the radius of its blur

// `plane`: the frame's plane of this role, or null. Pixels do not move without motion vectors, and
// have no outline without depth. Without a whole camera nothing is out of focus.
Image<metrics::PixelClass> pixel_classes(const FrameDescription& frame,
                                         const std::function<const ImageF*(Role)>& plane);

}  // namespace postchain::experiment
