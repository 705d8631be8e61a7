// What is hidden behind nearer surfaces, for the inverse warp's double-precision reference. Written
// from docs/inverse_warp.md.
#pragma once

#include <array>
#include <vector>

#include "chain/image.h"
#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

class Background {
  public:
    // `color` may be wide (wide_color.h). `surfaces`: of each of its pixels, row by row.
    Background(const ImageD& color, const std::vector<Surface>& surfaces);

    // The color (as wide as it is) at `at`, pixels, of a surface of this inverse depth or a smaller
    // one; `otherwise` where the cells around have none.
    std::vector<double> at(Vec at, double inverse_depth,
                           const std::vector<double>& otherwise) const;

  private:
    // The farthest surface of a square of pixels: mean color, inverse depth, part of the square.
    struct Cell {
        std::vector<double> color = {};
        double inverse_depth = 0;
        double part = 0;
    };
    struct Level {
        int edge_px = 0, columns = 0, rows = 0;
        std::vector<Cell> cells;
    };
    static Cell of_four(const std::array<Cell, 4>& quarters);

    std::vector<Level> levels_;
};

}  // namespace postchain::inverse_warp::reference
