// A chain's plan between a host's textures: a step before it that makes canonical planes of what is
// not in that form, and one after it that writes the host's output, where either is needed.
#pragma once

#include "chain/chain.h"
#include "chain/guest/host_frame.h"
#include "chain/plan.h"
#include "chain/planner.h"
#include "chain/status.h"

namespace postchain::guest {

struct HostPlan {
    Plan plan;
    // Textures that the host hands in; -1 = none, or no step uses it.
    TextureId color = -1, depth = -1, motion = -1, exposure = -1;
    // What holds the result; -1: the host's color as it is. It is the host's output where that is
    // written by the plan.
    TextureId result = -1;
    bool writes_output = false;
    int import_step = -1, export_step = -1;  // those with a GuestUniforms
    int debug_step = -1;                     // of a work list
};

// What the host's flags make of a plan.
PlanOptions options_of(const HostFrame& frame);

// Plans the frame as a part of a host's. Errors: those of make_plan(), and PC_ERROR_ARGUMENT if
// debug_view names no texture of the plan.
Result<HostPlan> make_host_plan(const ResolvedChain& resolved, const HostFrame& frame);
Result<HostPlan> make_host_plan(const Chain& chain, const HostFrame& frame);

// Every program of the host plans of frames like this: with the same textures, formats and rows,
// whatever their camera, values, matrices and number are. Debug views are left out.
std::vector<ProgramKey> host_programs(const Chain& chain, const HostFrame& frame);

}  // namespace postchain::guest
