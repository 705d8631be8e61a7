// make_plan: a chain and what is known of a frame -> the plan for that frame. Pure.
#pragma once

#include <set>
#include <string>

#include "chain/chain.h"
#include "chain/plan.h"

namespace postchain {

struct PlanOptions {
    Precision precision = Precision::fp32;
    bool elide = true;                // false: no rule is used
    std::set<std::string> rules_off;  // of those that are on by default: not to be used
    std::set<std::string> rules_on;   // of the others: to be used
    RoleSet outputs = {Role::color};

    bool uses(const ElisionRule& rule) const;
    // Names of the chain's own rules and of those of its passes that are in use.
    std::set<std::string> rules(const Chain& chain) const;
};

// frame.camera is what the input brought; the chain's own camera is laid over it here.
// Errors: StatusCode::input when a plane is missing that a pass requires (what was found is
// listed) and rule missing_plane is not in use, StatusCode::chain when a pass cannot run on this
// frame.
Result<Plan> make_plan(const Chain& chain, const FrameDescription& frame,
                       const PlanOptions& options = {});

// Every pass's reference in the chain's order, elided by no rule but camera_cut and
// missing_plane. Stages are named as the plan names its textures ("0.motion_blur.tile_max").
Result<ReferenceFrame> run_reference(const Chain& chain, const FrameDescription& frame,
                                     PlaneView planes, const PlanOptions& options = {});

}  // namespace postchain
