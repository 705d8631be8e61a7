// The effect `unmoved` of a matte: objects that count as standing still while the shutter is open
// (docs/layers.md). The pass itself knows nothing of it: it gets motion vectors without the
// object's motion.
#pragma once

#include "chain/chain.h"
#include "chain/matte.h"

namespace postchain {

// A pass with the effect `unmoved`, and the frame that the pass sees: with the speeds of what is
// beside the object, if they are known.
ResolvedPass unmoved(ResolvedPass pass, MattedPass::Seen frame, int matte);
FrameDescription with_still_objects(const FrameDescription& frame, int matte);

// Enters into frame.speeds_beside the speeds for every pass that holds objects still. `frame`: with
// its mattes. Enters nothing if planes are missing.
void find_speeds(const Chain& chain, const PlaneView& planes, FrameDescription& frame);

}  // namespace postchain
