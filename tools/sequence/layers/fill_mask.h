// The fill mask of `--fill-mask NAME`: which shares of a pixel came from its frame, from a
// neighbor, and from an estimate. A frame with one is filtered with one more layer
// (chain/frame/layers.h), its first.
#pragma once

#include <string>
#include <vector>

#include "chain/frame/frame.h"

namespace postchain::sequence {

// "NAME.frame", "NAME.neighbor", "NAME.background": in the order of the layer's channels.
std::vector<std::string> fill_mask_channels(const std::string& name);

// Errors (usage): not a name of channels.
Status check_fill_mask(const std::string& name);

FrameDescription with_fill_mask(FrameDescription frame);

// The planes that this describes, made from those of `frame`.
SharedPlanes planes_with_fill_mask(SharedPlanes planes, const FrameDescription& frame);

// Takes the fill mask, whose shares sum to 1, out of filtered layers. Empties them if there is no
// other. (Beside a matte's soft pixels a pass weighs color's channels separately.)
ImageF take_fill_mask(ImageF& layers, int height);

}  // namespace postchain::sequence
