// Edges of surfaces before a clear background. Color is antialiased, but depth is one sample: a
// pixel that a surface covers partly may have the background's infinite depth and would be blurred
// with it. Since the background is clear, all light and alpha of the pixel belong to the surface.
#pragma once

#include <cstdint>

#include "chain/frame.h"
#include "chain/image.h"

namespace postchain::sequence {

inline constexpr int kClearEdgeRows = 3;

// Gives partly covered (0 < alpha < 1), infinitely far pixels of a canonical frame the depth and
// motion vectors of a nearby surface: from the smallest square around the pixel, at most 3 pixels
// away, that contains a surface pixel, the one with the largest alpha. Bounds stay valid. Returns
// how many of the strip's pixels it changed; up to kClearEdgeRows rows above and below the strip
// are read too.
uint64_t fill_clear_edges(FramePlanes& planes, const Strip& strip);

}  // namespace postchain::sequence
