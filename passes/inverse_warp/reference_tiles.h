// Tiles of the inverse warp's double-precision reference: which surfaces a search starts from.
// Written from docs/inverse_warp.md.
#pragma once

#include <array>
#include <vector>

#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

struct Tile {
    std::array<Surface, 3> surfaces;  // its own that are displaced most differently
    std::vector<Surface> starts;      // of those that can be displaced into it, nearest first
    double longest = 0;               // displacement into it, px
};

// Of kBlockPx x kBlockPx pixels, row by row. `surfaces`: width x height.
std::vector<Tile> tiles_of(const std::vector<Surface>& surfaces, int width, int height,
                           const Settings& settings);

}  // namespace postchain::inverse_warp::reference
