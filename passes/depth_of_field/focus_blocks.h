// Blocks of 16 x 16 pixels by their circles of confusion: which return their color, which show the
// blurred copy alone, and what of the blurred copy anybody reads at all. Found on the device; no
// bit of the picture depends on it (rule focus_tiles).
#pragma once

#include "chain/pass.h"
#include "passes/depth_of_field/gilham.h"
#include "shaders/shared/depth_of_field_block.h"

namespace postchain::depth_of_field {

// Work lists; -1 = there is none, and the whole picture or copy is done.
struct FocusBlocks {
    TextureId sharp = -1, blurred = -1, mixed = -1;  // of the picture
    TextureId small = -1, blur_x = -1, blur_y = -1;  // of the down-sampled copy
};

// Adds the steps that fill the lists. `row_range` is what coc.comp writes of each run of pixels,
// `guided` whether the copy has a guide plane (leak: depth or coc).
FocusBlocks add_focus_blocks(PassPlanner& planner, const shared::DepthOfFieldBlock& block,
                             const GilhamSizes& sizes, TextureId row_range, bool guided);

}  // namespace postchain::depth_of_field
