// Blocks that a filter does not change.
#pragma once

#include "chain/pass.h"

namespace postchain {

// Adds the step "keep" (shaders/common/keep.comp): the blocks of `list` take the pass's input color
// to `kept`, bit for bit, and have no hint (-1: none is written).
void add_keep(PassPlanner& planner, TextureId list, TextureId kept, TextureId hint);

}  // namespace postchain
