// What each step of a plan has to wait for before it runs: pure, so that it can be checked where no
// device shows a barrier that is missing.
#pragma once

#include <cstdint>
#include <vector>

#include "chain/plan.h"

namespace postchain {

// Of what earlier steps wrote, or read in a texture that is written now. Bits of a set.
enum Wait : uint32_t {
    kWaitFetch = 1,   // before it is fetched through a sampler
    kWaitImage = 2,   // before it is written as an image, where its storage was another texture
    kWaitList = 4,    // before a work list is read or filled
    kWaitLaunch = 8,  // before a work list launches a step
};

// One set for each step; steps that wait are as few as their order allows, and each waits for all
// that those up to the next that waits need. `storage`: for each of the plan's textures the number
// of what holds it; textures that live one after the other may share one. Steps that write one
// texture together write different pixels of it, and wait for none of each other.
std::vector<uint32_t> waits_of(const Plan& plan, const std::vector<int>& storage);

}  // namespace postchain
