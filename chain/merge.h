// merge_plans: two plans for one frame -> one plan that does what both need once. Pure.
//
//   A:  coc -> blur -> tiles -> gather        merged:  A's steps, then those of B that A has not:
//   B:  tiles -> gather' -> coc -> blur'               gather', blur'
//
// Two steps are the same when program, uniform block, groups and what they read are the same, and
// what they write has the same format and size. Steps that write one texture together, each its own
// blocks, are shared together or not at all. What for: docs/report.md, "ab".
#pragma once

#include <array>

#include "chain/plan.h"

namespace postchain {

struct MergedPlan {
    // passes: A's, then B's (Step::pass and Elision::pass count on); outputs are those of A.
    // Textures of B alone have "b." before their names. Of the frame's own elisions those that
    // both have.
    Plan plan;
    // Of A and of B; all live until the end.
    std::array<std::map<Role, TextureId>, 2> outputs;
    // Of A and of B, passes counted as in their own plans, work lists as in the merged one.
    std::array<std::vector<Elision>, 2> elisions;
    int shared_steps = 0;  // of B, that A's stand for
};

// Both plans must be of one frame: same size, same imported planes where they name the same role.
// The merged plan's results are those of `a` and `b` bit for bit.
MergedPlan merge_plans(const Plan& a, const Plan& b);

}  // namespace postchain
