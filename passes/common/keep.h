// Blocks that a filter does not change.
#pragma once

#include "chain/pass/pass.h"

namespace postchain {

// The textures that the blocks keep, and their targets; -1 = none.
struct KeepTargets {
    TextureId color = -1;       // takes the pass's input color, bit for bit
    TextureId given_hint = -1;  // goes to `hint`; without it the hint is 0
    TextureId hint = -1;
    TextureId soft = -1;    // becomes 0
    TextureId layers = -1;  // take the pass's input layers, bit for bit
};

// Adds the step "keep" (shaders/common/keep.comp) for the blocks of `list`.
void add_keep(PassPlanner& planner, TextureId list, const KeepTargets& kept);

}  // namespace postchain
