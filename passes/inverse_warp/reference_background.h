// The fill of surfaces that no frame shows, in the inverse warp's double-precision reference
// (background.comp, background.glsl). Written from docs/inverse_warp.md.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "chain/image.h"
#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

class Background {
  public:
    // `color` may be wide (wide_color.h). `surfaces`: one for each of its pixels, row by row.
    Background(const ImageD& color, const std::vector<Surface>& surfaces);

    // The color at the position `at`, pixels, of a surface with at most this inverse depth, from
    // the smallest cells around that show one. If none does: `otherwise`.
    Color at(Vec at, double inverse_depth, const Color& otherwise) const;

    // Cells of the smallest size that show one surface, on both sides of what hides it.
    struct Sides {
        std::array<int, 2> first = {}, second = {};
    };
    // The sides of what continues behind the surface of inverse depth q that pixel x shows. None
    // are known: nothing.
    std::optional<Sides> sides_of(Vec x, double q) const;
    double inverse_depth(std::array<int, 2> cell) const { return smallest(cell).inverse_depth; }
    // The color at the position `at`, pixels, of what the sides show.
    Color color_behind(const Sides& sides, Vec at) const;

  private:
    // The farthest surface in a square of pixels: mean color, inverse depth, part of the square.
    struct Cell {
        Color color = {};
        double inverse_depth = 0;
        double part = 0;
    };
    struct Level {
        int edge_px = 0, columns = 0, rows = 0;
        std::vector<Cell> cells;
    };
    static Cell merge(const std::array<Cell, 4>& quarters);
    const Cell& smallest(std::array<int, 2> cell) const;
    bool one_surface(const Sides& sides) const;
    // Distance, in cells, to the first surface behind inverse depth q; 0 if there is none.
    int distance_behind(std::array<int, 2> cell, std::array<int, 2> line, double q) const;

    std::vector<Level> levels_;
    int columns_ = 0, rows_ = 0;  // cells of the smallest size within the frame
};

}  // namespace postchain::inverse_warp::reference
