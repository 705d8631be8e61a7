// The order of a plan's steps, and what each has to wait for: pure functions, so that they can be
// tested on devices that do not show a missing barrier.
#pragma once

#include <cstdint>
#include <vector>

#include "chain/plan/plan.h"

namespace postchain {

// Waits for results of earlier steps, or for their reads of a texture that is now written. Bits of
// a set.
enum Wait : uint32_t {
    kWaitFetch = 1,   // before it is fetched through a sampler
    kWaitImage = 2,   // before it is read as an image, or written as one if its storage was another
                      // texture
    kWaitList = 4,    // before a work list is read or filled
    kWaitLaunch = 8,  // before a work list launches a step
};

// One set for each step. As few steps wait as their order allows, and each waits for everything
// that the steps up to the next waiting one need. `storage`: the number of the storage of each
// texture of the plan; textures with disjoint lifetimes may share one. Steps that write one texture
// together write different pixels of it, and do not wait for each other. A step that writes some
// pixels again follows one that has read them, and waits for that.
std::vector<uint32_t> waits_of(const Plan& plan, const std::vector<int>& storage);

// How a step uses a texture or list. Bits of a set.
enum StepUse : uint32_t {
    kUseFetch = 1,
    kUseImageRead = 2,
    kUseImageWrite = 4,
    kUseListRead = 8,
    kUseListWrite = 16,  // and read, as the atomic counters of a list are
    kUseLaunch = 32,
};
constexpr uint32_t kUseWrites = kUseImageWrite | kUseListWrite;
uint32_t uses_of(const Step& step, const Binding& binding);

// A storage that is used in another way from step `step` on, or again after a wait. `before`: the
// texture that used it last; -1 and `from` 0: none in this plan.
struct Transition {
    int step = 0;
    TextureId texture = -1, before = -1;
    uint32_t from = 0, to = 0;
    bool operator==(const Transition&) const = default;
};

// For devices that are told the state of each texture: the changes of state at the steps that wait,
// each for all steps up to the next one that waits, and those of first uses. By step.
// `waits`: waits_of() the plan.
std::vector<Transition> transitions_of(const Plan& plan, const std::vector<int>& storage,
                                       const std::vector<uint32_t>& waits);

// Enters into `storage` that imported textures of one name are one storage. `names`: of each
// texture; 0: not imported yet. True if `storage` has changed.
bool share_imports(const Plan& plan, const std::vector<unsigned>& names, std::vector<int>& storage);

// The level of each step, from 0: after every step whose results it reads, and every step that
// reads a texture that it overwrites; as late as possible without another level, so that textures
// live short. Steps that write one texture together stay in their order.
std::vector<int> levels_of(const Plan& plan);

// Sorts the steps by level; steps of one level keep their order. Steps of different passes may then
// be mixed. Lifetimes of textures are found anew.
void order_by_level(Plan& plan);

}  // namespace postchain
