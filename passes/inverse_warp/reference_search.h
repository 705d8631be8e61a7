// The search of the inverse warp's double-precision reference (search.glsl, neighbors.glsl): the
// surface that a sample sees at a pixel. Written from docs/inverse_warp.md.
#pragma once

#include <optional>
#include <vector>

#include "chain/image.h"
#include "passes/inverse_warp/reference_background.h"
#include "passes/inverse_warp/reference_starts.h"

namespace postchain::inverse_warp::reference {

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
    std::optional<Frame> second_layer;  // chain/behind.h, as a frame at this one's time
    double half_open = 1;               // half the open time, frames
    int own_steps = 2;                  // of the search from the pixel itself
    double together_px = 2;             // between the displacements of surfaces that move together
    double same_path_px = 0.25;         // between paths that are the same; infinite without motion
};

// Shared by all samples of a pixel.
struct Pixel {
    Vec p;
    int x = 0, y = 0;  // the same
    const double* color = nullptr;
    const Surface* surface = nullptr;
    Vec random;  // x in [0, 1), y in [-1, 1)
    const Block* block = nullptr;
    double weight_of_more = 0;  // of the block's samples beyond the first set
};

// A place in a frame that shows the sample's surface. Its inverse depth is -1 if there is none.
struct Found {
    const Frame* frame = nullptr;
    Vec at;  // px
    double inverse_depth = -1;
    Vec path;             // a
    bool beyond = false;  // this frame's border pixels, continued beyond it
};

// A surface that this frame hides: it continues behind the one shown at the position `at`.
struct Behind {
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
Found resolve_occluded(const Frames& frames, const Pixel& pixel, const Sample& now,
                       const Search& here);

// The nearest start surface, nearer than the inverse depth `found`, that is displaced to the pixel
// from behind what this frame shows.
Behind find_behind(const Frames& frames, const Background& background, const Pixel& pixel,
                   const Sample& now, const Search& here, double found);

}  // namespace postchain::inverse_warp::reference
