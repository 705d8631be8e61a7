// Work groups and work lists, the host's side of shaders/common/work_list.glsl. A pass sorts the
// blocks of kBlockPx x kBlockPx pixels of a plane by the work to do in them, and launches a step
// for each list:
//
//   Step sort = ...;
//   const TextureId still = add_work_list(planner, sort, 1, "still_blocks");
//   planner.step(std::move(sort));
//   Step keep = ...;
//   launch_by(keep, still);
//   planner.step(std::move(keep));
#pragma once

#include "chain/pass/pass.h"

namespace postchain {

// Work groups of kBlockPx x kBlockPx x 1 that cover width x height pixels; also the largest number
// of blocks in a work list of such a plane.
std::array<int, 3> groups_for(int width, int height);
// Likewise on frames of every size.
constexpr Area groups_for(const Area& pixels) {
    return pixels.in_squares(kBlockPx);
}

// A list with room for every block of a plane of this size; `step` fills it, as the buffer of this
// unit.
TextureId add_work_list(PassPlanner& planner, Step& step, int unit, const std::string& name,
                        const Area& pixels = {});

// The step does only the blocks of this list, or the whole plane if the list is -1: macro LIST,
// storage buffer 0, and the launch. Its shader takes its pixel from next_pixel().
void launch_by(Step& step, TextureId list);

// Records the work elided in the blocks of a list, or, with `outside`, in all other blocks: `item`
// is the pass's name for it, `taps_px` the fetches saved per pixel.
void elide_blocks(PassPlanner& planner, const std::string& item, const std::string& rule, Fact why,
                  TextureId list, int taps_px, bool outside = false);

}  // namespace postchain
