// Edges of surfaces before a clear background. A renderer's color is antialiased, its depth is that
// of one sample: a pixel that a surface covers in part may have the depth of the background,
// infinity, and would be blurred as if it were there. But the background is clear, so all light and
// alpha of the pixel are the surface's.
#pragma once

#include <cstdint>

#include "chain/frame.h"
#include "chain/strip.h"

namespace postchain::sequence {

inline constexpr int kClearEdgeRows = 3;

// Gives pixels of a canonical frame that are infinitely far (is_infinitely_far()) and covered in
// part, 0 < alpha < 1, depth and vectors of a surface near them: of the first square around the
// pixel, at most 3 pixels away, that holds one; in it of the pixel with the largest alpha. Bounds
// stay true. Returns how many pixels it changed of the strip's rows; up to kClearEdgeRows above and
// below them count as surroundings.
uint64_t fill_clear_edges(FramePlanes& planes, const Strip& strip);

}  // namespace postchain::sequence
