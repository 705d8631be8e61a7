// make_plan: a chain and what is known of a frame -> the plan for that frame. Pure.
#pragma once

#include <set>
#include <string>
#include <vector>

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
    RuleNames rules(const Chain& chain) const;
};

// What the passes of a chain do on a frame, as far as programs, textures, bindings and groups
// depend on the frame's camera, bounds and number. Frames that are equal but for these three have
// plans of one shape where their PlanShapes are equal: such plans differ in bytes of uniform
// blocks, in counts of taps and in the numbers of what is left out.
struct PlanShape {
    struct OfPass {
        RoleSet available, wanted;  // PlanContext
        bool color_is_input = false;
        bool elided = false;
        ShapeNumbers numbers = {};
        bool operator==(const OfPass&) const = default;
    };
    std::vector<OfPass> passes;
    bool operator==(const PlanShape&) const = default;
};

// frame.camera is what the input brought; the chain's own camera is laid over it here.
// Errors: StatusCode::input when a plane is missing that a pass requires (what was found is
// listed) and rule missing_plane is not in use, StatusCode::chain when a pass cannot run on this
// frame.
Result<Plan> make_plan(const Chain& chain, const FrameDescription& frame,
                       const PlanOptions& options = {});

// The shape of that plan, into a PlanShape that may have been used before: then nothing is
// allocated, unless it fails. `rules`: options.rules(chain). Errors: as make_plan().
Status find_shape(const Chain& chain, const FrameDescription& frame, const PlanOptions& options,
                  const RuleNames& rules, PlanShape& shape);

// Writes the bytes of this frame's uniform blocks over those of `plan`, which make_plan() gave for
// a frame of the same shape; steps that were added to it since are left alone. Allocates nothing.
void write_values(const Chain& chain, const FrameDescription& frame, const PlanOptions& options,
                  const RuleNames& rules, const PlanShape& shape, Plan& plan);

// Every pass's reference in the chain's order, elided by no rule but camera_cut and
// missing_plane. Stages are named as the plan names its textures ("0.motion_blur.tile_max").
Result<ReferenceFrame> run_reference(const Chain& chain, const FrameDescription& frame,
                                     PlaneView planes, const PlanOptions& options = {});

}  // namespace postchain
