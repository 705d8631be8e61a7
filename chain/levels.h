// Levels of a plan: steps of one level need nothing of each other, so that one barrier before each
// level is enough. Pure.
#pragma once

#include <vector>

#include "chain/plan.h"

namespace postchain {

// For each step its level, from 0: after every step whose results it reads, and every step that
// reads what it writes over; as late as no other level is needed, so that textures live short.
// Steps that write one texture together stay in their order.
std::vector<int> levels_of(const Plan& plan);

// Puts the steps into the order of their levels, those of a level as they stood. Steps of different
// passes may then stand between each other. Lifetimes of textures are found anew.
void order_by_level(Plan& plan);

}  // namespace postchain
