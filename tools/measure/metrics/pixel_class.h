// Classes of pixels by a frame's own planes, so that temporal error is measured apart in each.
#pragma once

#include <cstdint>
#include <functional>

#include "chain/base/image.h"
#include "chain/frame/frame.h"

namespace postchain::metrics {

inline constexpr double kMovingPx = 1.0 / 16;   // per frame; slower pixels are still
inline constexpr double kDefocusedPx = 0.5;     // radius of the circle of confusion
inline constexpr double kDepthJump = 0.1;       // in parts of the largest inverse depth there
inline constexpr double kOutlineReachPx = 2.0;  // of a jump, besides the radius of its blur

enum class PixelClass : uint8_t { still, moving, defocused, outline };  // the last that applies
inline constexpr const char* kPixelClassNames[] = {"still", "moving", "defocused", "outline"};
inline constexpr size_t kPixelClasses = std::size(kPixelClassNames);

// `plane`: the frame's plane of this role, or null. Pixels do not move without motion vectors, and
// have no outline without depth. Without a whole camera nothing is out of focus.
Image<PixelClass> pixel_classes(const FrameDescription& frame,
                                const std::function<const ImageF*(Role)>& plane);

}  // namespace postchain::metrics
