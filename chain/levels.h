// Levels of a plan: steps of one level are independent, so that one barrier before each level is
// enough. Pure.
#pragma once

#include <vector>

#include "chain/plan.h"

namespace postchain {

// The level of each step, from 0: after every step whose results it reads, and every step that
// reads a texture that it overwrites; as late as possible without another level, so that textures
// live short. Steps that write one texture together stay in their order.
std::vector<int> levels_of(const Plan& plan);

// Sorts the steps by level; steps of one level keep their order. Steps of different passes may then
// be mixed. Lifetimes of textures are found anew.
void order_by_level(Plan& plan);

}  // namespace postchain
