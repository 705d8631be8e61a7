// Sorts blocks of 16 x 16 pixels by their circles of confusion: blocks that return their color,
// blocks that show only the blurred image, and blocks of the blurred image that are read at all.
// Found on the device; no bit of the result depends on it (rule focus_blocks).
#pragma once

#include "chain/pass.h"
#include "passes/depth_of_field/gilham.h"

namespace postchain::depth_of_field {

// Work lists; -1 = none, and the whole image is filtered.
struct FocusBlocks {
    TextureId sharp = -1, blurred = -1, mixed = -1;  // of the frame
    TextureId small = -1, blur_x = -1, blur_y = -1;  // of the downsampled image
    TextureId blurs = -1;                            // mask: 1 where a block of the frame blurs
};

// Makes `sort`, a step of coc.comp over width x height pixels, fill the frame's lists and mask.
FocusBlocks sort_focus_blocks(PassPlanner& planner, Step& sort);

// Adds the steps that fill the lists of the downsampled image. `guided`: the Gaussian reads a guide
// plane (leak: depth or coc).
void add_needed_blocks(PassPlanner& planner, FocusBlocks& blocks, const GilhamSizes& sizes,
                       bool guided);
// Fills the uniform blocks of those steps.
void write_focus_uniforms(const GilhamSizes& sizes, UniformWriter& uniforms);

}  // namespace postchain::depth_of_field
