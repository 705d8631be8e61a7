// Work groups and work lists, the host's side: what shaders/common/work_list.glsl has on the
// device. A pass sorts the blocks of kBlockPx x kBlockPx pixels of a plane by what has to be done
// in them, and launches a step for each list:
//
//   Step sort = ...;
//   const TextureId still = add_work_list(planner, sort, 1, "still_blocks", width, height);
//   planner.step(std::move(sort));
//   Step keep = ...;
//   launch_by(keep, still);
//   planner.step(std::move(keep));
#pragma once

#include "chain/pass.h"
#include "shared/work_group.h"

namespace postchain {

using shared::kBlockPx;

// Work groups of kBlockPx x kBlockPx x 1 that cover width x height pixels; so many blocks have a
// work list of such a plane at most.
std::array<int, 3> groups_for(int width, int height);

// A list that holds every block of a plane of width x height pixels; `step` fills it, and sees it
// as the buffer of this unit.
TextureId add_work_list(PassPlanner& planner, Step& step, int unit, const std::string& name,
                        int width, int height);

// The step does the blocks of this list alone, or the whole plane when the list is -1: macro LIST,
// storage buffer 0, and the launch. Its shader takes its pixel from next_pixel().
void launch_by(Step& step, TextureId list);

// What is elided in the blocks of a list, or, with `outside`, in those not in it: `item` is the
// pass's own name for it, `taps_px` how many fetches that saves at each pixel.
void elide_blocks(PassPlanner& planner, const std::string& item, const std::string& rule, Fact why,
                  TextureId list, int taps_px, bool outside = false);

}  // namespace postchain
