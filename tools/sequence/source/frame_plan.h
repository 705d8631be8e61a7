// Plans a chain for a frame: the planes to read, from its header; then, from its pixels, the plan,
// the data window that is written, and warnings.
//
// The planes are chosen by plans too, since a plan alone knows what a chain reads. They cannot be
// those of the pixels: these exist only after reading.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Planes to read for this chain: those that a plan without facts reads, as if all neighbors
// existed, and those that its neighbors read from it. If the chain cannot be planned, all planes
// that it could use; plan_source_frame() then reports why.
RoleSet planes_needed(const Chain& chain, const SourceSettings& settings, const FrameHeader& header,
                      const PlanOptions& options);

// The plan of a frame, and the description that was planned: with the chain's camera, and the
// depths and speeds that its passes need. A fill mask is not in it.
struct FramePlan : Plan {
    FrameDescription description;
};

// make_plan() for this frame. Errors name the file and, if a plane is missing, the channel names
// looked for and found.
Result<FramePlan> plan_source_frame(const Chain& chain, const SourceFrame& frame,
                                    const PlanOptions& options);

// Largest distance in pixels that the passes of the plan move light.
double reach_of(const Chain& chain, const FramePlan& plan);

// The data window of the filtered frame: the file's, grown by the reach of the passes that run
// (Pass::reach), within the filtered window. Unchanged if no pass runs. Pixels outside are clear
// before and after.
io::Window written_window(const Chain& chain, const FramePlan& plan, const SourceFrame& frame);

// Warnings about a frame in view of the chain that will filter it, one line each, with the file:
// light lost at the border of a data window that is kept; streaks and circles of confusion that are
// clamped, with the count of pixels and the largest; a focus in meters that a pass needs although
// the length of a scene unit is unknown.
std::vector<std::string> plan_warnings(const Chain& chain, const FramePlan& plan,
                                       const SourceFrame& frame);

}  // namespace postchain::sequence
