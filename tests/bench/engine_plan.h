// Plans for an engine's frame: one motion plane, both neighbors, a lens and a shutter, and no known
// facts.
#pragma once

#include "chain/pass/planner.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tests/bench/arguments.h"

namespace postchain::bench {

// Planes that an offline renderer writes and an engine does not have.
inline constexpr RoleSet kMotionBack = {Role::motion_back,
                                        role_of(Neighbor::before, Role::motion_back),
                                        role_of(Neighbor::after, Role::motion_back)};

inline FrameDescription engine_frame(int width, int height) {
    FrameDescription frame;
    frame.width = frame.display_width = width;
    frame.height = frame.display_height = height;
    frame.planes = {Role::color, Role::inverse_depth, Role::motion};
    for (const Neighbor neighbor : kNeighbors)
        for (const Role role : kNeighborRoles) frame.planes.add(role_of(neighbor, role));
    frame.planes = frame.planes - kMotionBack;
    frame.camera.focal_length_mm = 50;
    frame.camera.sensor_width_mm = 36;
    frame.camera.f_stop = 2;
    frame.camera.focus_distance = 4;
    frame.camera.shutter_frames = 0.5;
    frame.camera.meters_per_unit = 1;
    return frame;
}

// Plans a chain file or a shipped chain; ends the program if there is none.
inline Plan plan_of(const std::string& chain, const FrameDescription& frame,
                    const PlanOptions& options = {}) {
    const Result<ChainFile> file = load_chain(chain, builtin_passes());
    if (!file.ok()) fail(file.status().message(), 2);
    Result<Plan> plan = make_plan(file->chain, frame, options);
    if (!plan.ok()) fail(plan.status().message(), 2);
    return std::move(*plan);
}

}  // namespace postchain::bench
