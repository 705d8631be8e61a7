// The depths at the places that chains focus at (`focus_at`), followed over time: what GL (focus.h)
// and Vulkan (chain/vk/focus.h) have in common. A step finds them on the device.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "chain/guest/failure.h"
#include "chain/guest/host_frame.h"
#include "chain/pass/chain.h"
#include "chain/plan/plan.h"

namespace postchain::guest {

using Depths = std::map<Place, double>;  // inverse depths, 1/scene units

// The depths that the step found in a frame, in the order of the places.
using FoundDepths = std::array<float, GUEST_FOCUS_PLACES>;

// The program of the step.
ProgramKey focus_program(const HostFrame& frame);
// The step, whose uniform block is uniforms_of() the frame. `depth`: the host's; `found`: a buffer
// of FoundDepths, at HostFrame::focus_slot.
Step focus_step(const HostFrame& frame, TextureId depth, TextureId found);

// The places of a chain, each once. PC_ERROR_CHAIN: more than GUEST_FOCUS_PLACES.
Failure find_places(const Chain& chain, Depths& places);

// A chain's depths in focus.
struct Followed {
    uint64_t chain = 0;
    size_t number = 0;  // among the chains, below FollowedChains::kMost
    Depths depths;
    bool known = false;  // from a frame of this shot
    uint64_t since = 0;  // depths that earlier frames found do not count

    // Moves the depths towards what was found: all the way if none is known.
    void approach(const FoundDepths& found, const pc_frame& given);
};

class FollowedChains {
  public:
    static constexpr size_t kMost = 64;
    // The chain's, with these places. If they are new, depths found before frame `next` do not
    // count.
    Followed& find(uint64_t chain, const Depths& places, uint64_t next);

  private:
    std::vector<Followed> chains_;  // the one that ran last is the last
};

}  // namespace postchain::guest
