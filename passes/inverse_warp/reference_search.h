// The search of the inverse warp's double-precision reference (search.glsl, second_layer.glsl,
// neighbors.glsl): the surface that a sample sees at a pixel, in any frame or continued behind what
// this frame shows; and the fill of surfaces that no frame shows (background.comp,
// background.glsl). Written from the rules, which docs/inverse_warp.md has in short.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "chain/base/image.h"
#include "passes/inverse_warp/reference_surfaces.h"

namespace postchain::inverse_warp::reference {

class Background {
  public:
    // `color` may be wide (wide_color.h). `surfaces`: one for each of its pixels, row by row.
    Background(const ImageD& color, const std::vector<Surface>& surfaces);

    // The color at the position `at`, pixels, of a surface with at most this inverse depth, from
    // the smallest cells around that show one. If none does: `otherwise`.
    Color at(Vec at, double inverse_depth, const Color& otherwise) const;
    // Do the smallest cells around this position show one?
    bool shows(Vec at, double inverse_depth) const;
    // Would that color show a surface of inverse depth q or one hardly farther?
    bool is_filled(Vec at, double inverse_depth, double q) const;

    // Cells of the smallest size that show one surface, on both sides of what hides it.
    struct Sides {
        std::array<int, 2> first = {}, second = {};
    };
    // The sides of what continues behind the surface of inverse depth q that pixel x shows. None
    // are known: nothing.
    std::optional<Sides> sides_of(Vec x, double q) const;
    double inverse_depth(std::array<int, 2> cell) const { return smallest(cell).inverse_depth; }
    // The color at the position `at`, pixels, of what the sides show.
    Color continued_color(const Sides& sides, Vec at) const;

  private:
    // The farthest surface in a square of pixels: mean color, inverse depth, part of the square.
    struct Cell {
        Color color = {};
        double brightness = 0;
        double inverse_depth = 0;
        double part = 0;
    };
    // Between the cells on both sides of what hides a surface.
    struct Line {
        Sides sides;
        double span = 0;  // cells
        bool one_depth = false, one_surface = false;
        std::array<double, 3> brighter = {};  // of both sides, as parts of the level around
    };
    struct Level {
        int edge_px = 0, columns = 0, rows = 0;
        std::vector<Cell> cells;
    };
    static void dim_lamps(std::array<Cell, 4>& quarters);
    static Cell merge(const std::array<Cell, 4>& quarters);
    // Those around the position `at` that show a surface with at most this inverse depth, each with
    // its weight.
    static std::vector<std::pair<const Cell*, double>> around(const Level& level, Vec at,
                                                              double inverse_depth);
    const Cell& smallest(std::array<int, 2> cell) const;
    double level_around(std::array<int, 2> cell) const;
    Line line_between(const Sides& sides, double span, double level) const;
    // Distance, in cells, to the first surface behind inverse depth q; 0 if there is none.
    int distance_behind(std::array<int, 2> cell, std::array<int, 2> line, double q) const;

    std::vector<Level> levels_;
    int columns_ = 0, rows_ = 0;  // cells of the smallest size within the frame
};

// This frame or a neighbor.
struct Frame {
    double offset = 0;  // frames: -1 before, 1 after
    ImageD color;       // wide
    std::vector<Surface> surfaces;

    const Surface& surface(Vec pixel) const {
        return surfaces[size_t(pixel.y) * size_t(color.width) + size_t(pixel.x)];
    }
    Vec inside(Vec at) const;
};

struct Frames {
    Frame here;
    std::vector<Frame> neighbors;
    std::optional<Frame> second_layer;  // chain/frame/behind.h, as a frame at this one's time
    double half_open = 1;               // half the open time, frames
    bool lens = false;                  // it is open
    int own_steps = kSteps;             // of the search from the pixel itself
    double together_px = kTogetherPx;   // between the displacements of surfaces that move together
    double same_path_px = kSamePathPx;  // between paths that are the same; infinite without motion
};

// Shared by all samples of a pixel.
struct Pixel {
    Vec p;
    int x = 0, y = 0;  // the same
    const double* color = nullptr;
    const Surface* surface = nullptr;
    Vec random;  // x in [0, 1), y in [-1, 1)
    const Block* block = nullptr;
};

// A place in a frame that shows the sample's surface. Its inverse depth is -1 if there is none.
struct Found {
    const Frame* frame = nullptr;
    Vec at;  // px
    double inverse_depth = -1;
    Vec path;                  // a
    bool beyond = false;       // this frame's border pixels, continued beyond it
    bool edge = false;         // of a neighbor: its pixel is at a depth edge
    bool other_light = false;  // of a neighbor: Surface::other_light
};

// A surface that this frame hides: it continues behind the one shown at the position `at`.
struct Continuation {
    double inverse_depth = -1;  // -1: none
    Background::Sides sides;
    Vec path;  // a
    Vec at;    // px
};

// Result of the search in this frame.
struct Search {
    Found nearest;        // of the accepted surfaces
    double residual = 0;  // its error
    Surface far;          // the farthest surface visited
    double far_residual = 0;
    Vec far_at;                         // its pixel
    double first_depth = -1;            // inverse depth of the first surface visited
    std::vector<bool> occluded_starts;  // this frame may hide these start surfaces
};

// Searches from the surface `begin`, then from the start surfaces of the pixel's block. If
// `advance`, `begin` becomes the surface found from it.
Search search(const Frames& frames, const Pixel& pixel, const Sample& now, Surface& begin,
              bool advance);

// The nearest surface that the sample sees in any frame or in the layer behind.
Found resolve_occluded(const Frames& frames, const Background& background, const Pixel& pixel,
                       const Sample& now, const Search& here);

// The nearest start surface, nearer than the inverse depth `found`, that is displaced to the pixel
// from behind what this frame shows.
Continuation find_continuation(const Frames& frames, const Background& background,
                               const Pixel& pixel, const Sample& now, const Search& here,
                               double found);

}  // namespace postchain::inverse_warp::reference
