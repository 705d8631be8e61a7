// Start surfaces of the inverse warp's double-precision reference (block_surfaces.comp,
// starts.comp): the surfaces from which a search starts. Written from docs/inverse_warp.md.
#pragma once

#include <array>
#include <vector>

#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

struct Block {
    std::array<Surface, 3> surfaces;  // its own that are displaced most differently
    std::vector<Surface> starts;      // of those that can be displaced into it, nearest first
    double longest_px = 0;            // longest displacement into it
};

// Blocks of kBlockPx x kBlockPx pixels, row by row. `surfaces`: width x height.
std::vector<Block> blocks_of(const std::vector<Surface>& surfaces, int width, int height,
                             const Settings& settings);

}  // namespace postchain::inverse_warp::reference
