// Mattes, and their effects on a pass. The method: docs/layers.md. The pass itself knows nothing of
// them.
//
// `unblurred`: objects that the pass leaves as they are. They are held out before the pass and laid
// over its result. The pass filters two more layers, color without the object and the part of each
// pixel that is not the object.
//
// `unmoved`: objects that count as standing still while the shutter is open. The pass gets motion
// vectors without the object's motion.
#pragma once

#include <map>
#include <vector>

#include "chain/pass/chain.h"
#include "chain/pass/pass.h"

namespace postchain {

// A link of a chain on a frame: its pass with the effect of its matte. Errors: Pass::resolve()'s,
// and of the matte.
Result<ResolvedPass> resolve_link(const Chain& chain, size_t link, const FrameDescription& frame);
// Pass::every_shape() of the link, likewise.
std::vector<ResolvedPass> every_shape(const Chain& chain, size_t link,
                                      const FrameDescription& frame);

// Replaces the layers by those that the pass filters, with the object held out, in the reference.
void hold_out_reference(std::map<Role, ImageD>& planes, int matte);

// Enters into frame.speeds_beside the speeds for every pass that holds objects still. `frame`: with
// its mattes. Enters nothing if planes are missing.
void find_speeds(const Chain& chain, const PlaneView& planes, FrameDescription& frame);

}  // namespace postchain
