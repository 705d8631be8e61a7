// A chain's plan between a host's textures. If needed, a step before the chain converts textures to
// canonical planes, and a step after it writes the host's output.
#pragma once

#include "chain/base/status.h"
#include "chain/guest/host_frame.h"
#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "chain/plan/plan.h"

namespace postchain::guest {

// The host's textures of a frame or a neighbor; -1 = not given, or no step uses it.
struct HostInputs {
    TextureId color = -1, depth = -1, motion = -1, exposure = -1;
    int makes = 0;  // GuestUniforms::makes of the import
};

struct HostPlan : HostInputs {
    Plan plan;
    TextureId mask = -1;
    std::array<HostInputs, kNeighbors.size()> neighbors;
    // The texture with the result; -1: the host's color, unchanged. The host's output if the plan
    // writes it.
    TextureId result = -1;
    bool writes_output = false;
    std::vector<int> own_steps;  // those with a GuestUniforms of the frame
    std::array<int, kNeighbors.size()> neighbor_steps = {-1, -1};  // with one of the neighbor
    TextureId shown = -1;         // the texture that a debug view draws
    bool samples_arrays = false;  // a step samples an array of textures
};

// The plan options that the host's flags select.
PlanOptions options_of(const HostFrame& frame, DeviceClass device);

// Plans a host's frame. Errors: those of make_plan(), and PC_ERROR_ARGUMENT if debug_view does not
// name a texture of the plan.
Result<HostPlan> make_host_plan(const ResolvedChain& resolved, const HostFrame& frame);
Result<HostPlan> make_host_plan(const Chain& chain, const HostFrame& frame, DeviceClass device);

// The uniform block of the steps that convert this frame from and to the host's textures.
shared::GuestUniforms uniforms_of(const HostFrame& frame, const HostPlan& host, const Plan& plan);
// Likewise of the step that converts a neighbor.
shared::GuestUniforms uniforms_of(const HostPlanes& neighbor, const HostInputs& inputs);

// Every program of the host plans of frames of one kind: of this chain, with these flags of planes
// and elision, with an exposure or without, and with depth, motion, mask and neighbors of this
// frame or without; and those of `plan`, which may be of a debug view. Each once.
std::vector<ProgramKey> host_programs(const Chain& chain, const HostFrame& frame, const Plan& plan,
                                      DeviceClass device);

}  // namespace postchain::guest
