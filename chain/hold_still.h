// The effect `unmoved` of a matte: objects that count as standing still while the shutter is open
// (docs/layers.md). The pass itself knows nothing of it: it gets vectors without the object's
// motion.
#pragma once

#include <array>
#include <map>

#include "chain/chain.h"
#include "chain/pass.h"

namespace postchain {

// The frame as a pass with such a matte sees it: with the speeds of what is beside the object,
// where they are known.
FrameDescription with_still_objects(const FrameDescription& frame, int matte);

// What hold_still() puts in the place of a frame's planes: restored after the pass.
inline constexpr std::array<Role, 4> kStillRoles = {
    Role::motion, Role::motion_back, Role::inverse_depth_before, Role::inverse_depth_after};

// Adds the steps that make these planes and hands them on: of the frame its vectors without the
// object's motion; of its neighbors inverse depths below 0 where the object is. There it stands
// elsewhere, and what a search finds of it would be a second one.
void hold_still(PassPlanner& planner, int matte);

// The same in double precision.
void hold_still_reference(std::map<Role, ImageD>& planes, int matte);

// Enters into frame.speeds_beside the speeds for every pass that holds objects still. `frame`: with
// its mattes. Without the planes there is nothing to enter.
void find_speeds(const Chain& chain, const PlaneView& planes, FrameDescription& frame);

}  // namespace postchain
