// The layer behind: for each pixel the first surface behind the one that the frame shows, as
// another image of the same size. Passes that move surfaces take light from it where that surface
// is seen.
//
// It is handed in as one plane of the role `behind`, stacked like extra layers: color; inverse
// depth; motion and motion_back; then the frame's extra layers as that image has them. Inverse
// depth is in the first channel, and below 0 if nothing is known behind the pixel. A pixel that
// hides nothing may also show again what the frame shows.
#pragma once

#include "chain/frame/frame.h"

namespace postchain {

inline constexpr int kBehindPlanes = 3;  // before the extra layers

// From the canonical planes of that image: color, inverse_depth [, motion [, motion_back]]
// [, layers]. Without motion nothing moves; without motion_back paths are straight.
ImageF stack_behind(const PlaneView& planes);

}  // namespace postchain
