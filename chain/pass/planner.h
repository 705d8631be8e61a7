// make_plan: a chain and the description of a frame -> the plan for that frame. Pure.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "chain/pass/resolved_chain.h"
#include "chain/plan/device_class.h"
#include "chain/plan/plan.h"

namespace postchain {

struct PlanOptions {
    Precision precision = Precision::fp32;
    bool elide = true;                     // false: no rule is used
    std::set<std::string> rules_off = {};  // rules on by default that are not used
    std::set<std::string> rules_on = {};   // other rules that are used
    RoleSet outputs = {Role::color};
    // The class of the device that runs the plan: Executor::device_class(). A plan for another
    // class has the same result and takes longer.
    DeviceClass device = DeviceClass::software;
    bool fast_math = false;  // compilers may contract and reorder the programs' arithmetic

    bool uses(const ElisionRule& rule) const;
    // Names of the chain's own rules and of those of its passes that are in use.
    RuleNames rules(const Chain& chain) const;
};

// The plan of a chain that was resolved on a frame.
Result<Plan> make_plan(const ResolvedChain& resolved);

// Resolves the chain and plans it. frame.camera is the input's; the chain's own camera is laid over
// it here. Errors: StatusCode::input if a plane is missing that a pass requires (the planes found
// are listed) and rule missing_plane is not in use; StatusCode::chain if a pass cannot run on this
// frame.
Result<Plan> make_plan(const Chain& chain, const FrameDescription& frame,
                       const PlanOptions& options = {});

// One pass alone: adds its steps to `plan`, as its last pass, and removes those that nothing reads
// under the rules of the context. `current`: its planes so far; each is an input here.
Plan plan_alone(Plan plan, std::map<Role, TextureId> current, const PassOnFrame& pass,
                const PlanContext& context);

// Every program that a plan of this chain may need for frames with the same planes, layers and
// mattes, under the same options, whatever their lens, shutter, bounds and number are.
std::vector<ProgramKey> programs_of(const Chain& chain, const FrameDescription& frame,
                                    const PlanOptions& options);

// Every pass's reference in the chain's order, elided by no rule but camera_cut and
// missing_plane. Stages are named as the plan names its textures ("0.motion_blur.tile_max").
Result<ReferenceFrame> run_reference(const Chain& chain, const FrameDescription& frame,
                                     PlaneView planes, const PlanOptions& options = {});

}  // namespace postchain
