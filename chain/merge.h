// merge_plans: two plans for one frame -> one plan that does their common work once. Pure.
//
//   A:  coc -> blur -> tiles -> gather        merged:  A's steps, then those of B that A has not:
//   B:  tiles -> gather' -> coc -> blur'               gather', blur'
//
// Two steps are the same if program, uniform block, groups and inputs are the same, and their
// results have the same format and size. Steps that write one texture together, each its own
// blocks or one over another, and those that read it in between, are shared together or not at all.
// Used by: docs/report.md, "ab".
#pragma once

#include <array>

#include "chain/plan.h"

namespace postchain {

struct MergedPlan {
    // passes: A's, then B's (Step::pass and Elision::pass count on); outputs are those of A.
    // Textures that only B has get "b." before their names. Elisions of the frame itself are kept
    // if both plans have them.
    Plan plan;
    // Outputs of A and of B; all live until the end.
    std::array<std::map<Role, TextureId>, 2> outputs;
    // Elisions of A and of B: passes counted as in their own plans, work lists as in the merged
    // one.
    std::array<std::vector<Elision>, 2> elisions;
    int shared_steps = 0;  // steps of B replaced by steps of A
};

// Both plans must be of one frame: same size, the same imported planes for the same roles. The
// merged plan's results are those of `a` and `b` bit for bit.
MergedPlan merge_plans(const Plan& a, const Plan& b);

}  // namespace postchain
