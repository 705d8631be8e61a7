// Surfaces of the inverse warp's double-precision reference: the surface seen in each pixel of a
// frame, its motion and its circle of confusion (surface.glsl, surfaces.comp, bright_edges.comp,
// shown_surfaces.comp, mixed_pixels.comp), a neighbor's light beside this frame's (light.comp), and
// the surfaces from which a search starts (block_surfaces.comp, hidden_surfaces.comp,
// start_choice.glsl). Written from the rules, which docs/inverse_warp.md has in short.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "chain/base/image.h"
#include "passes/inverse_warp/inverse_warp.h"
#include "shaders/shared/inverse_warp_constants.h"

namespace postchain::inverse_warp::reference {

struct Vec {
    double x = 0, y = 0;
};
inline Vec operator+(Vec a, Vec b) {
    return {a.x + b.x, a.y + b.y};
}
inline Vec operator-(Vec a, Vec b) {
    return {a.x - b.x, a.y - b.y};
}
inline Vec operator*(double s, Vec v) {
    return {s * v.x, s * v.y};
}
inline double dot(Vec a, Vec b) {
    return a.x * b.x + a.y * b.y;
}

// Color of a pixel: RGBA, then its extra layers (wide_color.h).
using Color = std::vector<double>;

// One time sample, u in [-1, 1], and one lens sample.
struct Sample {
    double u = 0;
    Vec lens;
    double weight = 1;       // less than 1: part of a sample
    double depth_ratio = 1;  // inverse depths within this ratio count as one depth
};

// Lengths in pixels. Without motion a and b are 0; without a lens the radius is 0.
struct Surface {
    Vec a, b;
    double straight = 0;
    double inverse_depth = 0;
    double radius = 0;
    bool edge = false;
    bool other_light = false;  // of a neighbor: hidden here, where the light around it has changed
    std::optional<Vec> color_from;  // at an edge: from the pixel to the one known to show its color
    Vec front_from;         // likewise, of a surface that stays in place in front of this one ...
    double front_part = 0;  // ... and has this part of the pixel

    // Longest path on either side of the frame.
    double path() const;
    // h: half the open time, frames
    Vec displacement(const Sample& at, double h) const;
};

bool one_depth(double q, double r);

// Planes of an image; null: not available.
struct Planes {
    const ImageD* inverse_depth = nullptr;
    const ImageD* motion = nullptr;
    const ImageD* motion_back = nullptr;
    bool may_lack = false;  // of a neighbor or the layer behind: pixels below 0 are not there
    // Motion and motion_back of the frames before and after, if both are available.
    struct Turns {
        const ImageD* motion = nullptr;
        const ImageD* motion_back = nullptr;
    } before = {}, after = {};
};

// Inverse depth of pixels that are not there: they are never found.
inline constexpr double kNotThere = -2;

// Row by row, as their texture stores them: a without its last 3 bits, b in steps of 1/64 px, the
// inverse depth without its last 2 bits, w in 6 bits.
std::vector<Surface> surfaces_of_planes(const Planes& planes, const Settings& settings);
// The pixels at edges, mixtures of two surfaces, that are split: none; those that show the surface
// in front; or also those that take the color of their own from another pixel.
enum class Split { none, in_front, all };
// Bright pixels at edges get the surface whose light they show. Other pixels there are split: with
// `motion`, by the averages in it too.
std::vector<Surface> shown_surfaces(const ImageD& color, const ImageD* motion,
                                    std::vector<Surface> of_planes, const Settings& settings,
                                    Split split);

// Size of a surface's displacements and difference between those of two, px^2; the longest, px.
double displaced(const Surface& s, const Settings& settings);
double apart(const Surface& s, const Surface& t, const Settings& settings);
double longest(const Surface& s, const Settings& settings);

// Colors are compared as parts of a level, a multiple of the brightness of these places, RGB
// (brightness.glsl).
double level_of(const std::vector<const double*>& places, double times);
double as_part_of(double component, double level);

// Half the open time, frames: 1 without a shutter.
double half_open_of(const Settings& settings);

// A frame's color and, for each of its pixels, a surface.
struct ShadedFrame {
    const ImageD& color;
    const std::vector<Surface>& surfaces;
};

// Marks those of `shown`, the neighbor's surfaces, that this frame hides and around which the light
// differs. `there` has the surfaces of the neighbor's planes. offset: -1 before, 1 after
void mark_other_light(const ShadedFrame& here, const ShadedFrame& there, double offset,
                      const Settings& settings, std::vector<Surface>& shown);

struct Block {
    std::array<Surface, 3> surfaces;  // its own that are displaced most differently
    std::vector<Surface> starts;      // of those that can be displaced into it, nearest first
    double longest_px = 0;            // longest displacement into it
};

// Surfaces of a neighbor or of the layer behind, some of which this frame hides.
struct OtherSurfaces {
    double offset = 0;  // frames: -1 before, 1 after; 0: the layer behind
    const std::vector<Surface>* surfaces = nullptr;
};

// Blocks of kBlockPx x kBlockPx pixels, row by row. `surfaces`, and those of each of `others`:
// width x height.
std::vector<Block> blocks_of(const std::vector<Surface>& surfaces, int width, int height,
                             const std::vector<OtherSurfaces>& others, const Settings& settings);

}  // namespace postchain::inverse_warp::reference
