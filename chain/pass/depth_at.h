// The depth at a place in the frame, for passes whose focus is a place: a fact of the frame.
#pragma once

#include "chain/frame/frame.h"
#include "chain/pass/chain.h"

namespace postchain {

// The median inverse depth of the 5 x 5 pixels around a place of the display window, fractions from
// the top left; at a data window's border over the pixels that exist, beyond it over the nearest
// pixels. The sky counts as 0. `inverse_depth`: canonical, of the size of `frame`.
double inverse_depth_at(const ImageF& inverse_depth, const FrameDescription& frame, Place place);

// Enters the depth at every place that a pass of the chain needs into
// frame.bounds.inverse_depth_at. Enters nothing if the plane is missing.
void find_depths(const Chain& chain, const PlaneView& planes, FrameDescription& frame);

}  // namespace postchain
