// Bright light out of focus, for the inverse warp's double-precision reference: which part of what
// a pixel's samples have seen it is, and how pixels share it. Written from docs/inverse_warp.md.
#pragma once

#include <array>

#include "chain/image.h"
#include "passes/common/inverse_warp.h"

namespace postchain::inverse_warp::reference {

// Of the tile of kBlockPx x kBlockPx pixels in column i, row j of RGBA `color`: the mean of its
// pixels' largest components.
double light_of_tile(const ImageD& color, int i, int j);

// Of one pixel's samples.
class Highlights {
  public:
    // `light`: of the pixel's tile.
    Highlights(const Settings& settings, double light);

    // A sample that has seen this color on a surface of this inverse depth.
    void add(const std::array<double, 4>& seen, double inverse_depth);

    std::array<double, 4> excess = {};  // sum of the light above the limit; how many out of focus
    double squares = 0;                 // sum of the squares of its largest component

  private:
    const Settings& settings_;
    double bright_;  // the limit
};

// Each pixel of `color`, RGBA, gets its share of the light around it, within the range of the
// pixels there. excess, squares: of each pixel the means over its samples.
void share_highlights(const Settings& settings, const ImageD& excess, const ImageD& squares,
                      ImageD& color);

}  // namespace postchain::inverse_warp::reference
