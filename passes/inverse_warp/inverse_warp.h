// The inverse warp: for every instant of the open shutter and every point of the lens, which
// surface stood at this pixel? Shared by the passes that blur by it. Method, measurements:
// docs/inverse_warp.md.
//
//   inverse_depth [, motion [, motion_back]] --surfaces-> surfaces_of_planes
//   color, surfaces_of_planes --bright_edges-> shown
//   surfaces_of_planes, shown --shown_surfaces-> surfaces; all of the frames before and after too
//   surfaces --block_surfaces-> block_surfaces
//   block_surfaces --starts--> starts; work lists: moving_blocks, still_blocks
//   color, surfaces --background--> background_color, background_depth
//   color, surfaces, starts, background_color, background_depth [, noise] [, lens_points]
//                                                     --gather-> color [, hint]     moving_blocks
//   color [, hint]                                    --keep---> color [, hint]     still_blocks
//   colors and surfaces of the frames before and after --gather-> what this frame does not show
//
// Where noise is taken away the gather makes `gathered`, `soft` and `spread`, and denoise color of
// them.
//
// Sources: Yang et al., Image-Based Bidirectional Scene Reprojection, 2011; Bowles et al.,
// Iterative Image Warping, 2012.
#pragma once

#include <optional>

#include "chain/pass.h"
#include "passes/common/aperture.h"
#include "passes/common/circle_of_confusion.h"
#include "passes/common/noise.h"

namespace postchain::inverse_warp {

inline constexpr int kMaxStarts = 8;

// Frames that are asked for what is hidden in this one.
enum class Neighbors { none, before, both };

struct Shutter {
    // Half the open time, frames; 0 only in plans of what a closed shutter saves.
    double half_open = 0.25;
    double max_path_px = 40;  // longest path on one side of the frame
    double path_px_per_time =
        2;                      // of the shutter alone: a time for so many pixels of a tile's path
    double time_jitter = 0.25;  // of the shutter alone: largest shift of its times, in spacings
};

struct Lens {
    lens::CircleOfConfusion coc;
    lens::Aperture aperture;
};

// What a pass that blurs by it lets its user choose of the search.
struct Parameters {
    int starts = 4;  // of a tile, beside the pixel's own; 1..kMaxStarts
    Neighbors neighbors = Neighbors::both;
};
const ParameterTable& parameter_table();

// At least one of shutter and lens.
struct Settings {
    std::optional<Shutter> shutter;
    std::optional<Lens> lens;
    int samples = 25;      // per pixel; of the shutter alone: at most; with a lens:
                           // 1..lens::kMaxPoints
    int more_samples = 0;  // with a lens: of tiles whose samples disagree, beyond `samples`; both
                           // together at most lens::kMaxPoints
    Parameters search;
    double still_limit_px = 0.5;  // a tile whose displacements are no longer keeps its color
    bool denoise = true;          // take the noise of the samples away where they are blurred
    noise::Parameters noise;      // shifts the times of a pixel, turns its points of the lens
    std::string still_rule;       // rule under which still blocks are found on the device
};

// Planes that it reads, color among them.
RoleSet required_planes(bool shutter);
RoleSet optional_planes(bool shutter, Neighbors neighbors);

// Why a small change of its planes can change its color by much more: of known limits.
inline constexpr const char* kBrightPixel =
    "bright pixel in black: it falls to 0 within one pixel, and a change of a path of 10 px by eps "
    "moves that edge by 10 eps";
inline constexpr const char* kSteepLens =
    "steep lens: at f/0.1, focused at the near plane, 1 % of depth is 22 px of radius, 560 px in a "
    "picture 16384 px wide: what was sharp is blurred";
inline constexpr const char* kApart =
    "paths that part: where neighbors part by 5 px a pixel nothing is found, and a position that "
    "rounds to the next pixel leads 5 px further, to another fill";

// What a pass promises that does nothing else.
Promises promises_of(const Settings& settings);
Reach reach_of(const Settings& settings, const FrameDescription& frame);

// The neighbors of this frame that are searched: those whose color, inverse depth and motion are
// there beside the frame's own motion. None where the shutter is open for less than an eighth of a
// frame: a frame is then too far away for what surfaces hold of their paths.
std::vector<Neighbor> searched_neighbors(const Settings& settings, RoleSet available);

// Adds the steps and textures above and hands on color and, where it is wanted, the hint: of a
// shutter a new one, of the lens alone the one it was given.
void plan_warp(PassPlanner& planner, const Settings& settings);
// Pass::shape and Pass::values of it.
ShapeNumbers shape_of(const Settings& settings, const PlanContext& context);
void write_values(const Settings& settings, const PlanContext& context, UniformWriter& uniforms);

}  // namespace postchain::inverse_warp
