// The inverse warp: for every instant of the open shutter, which surface stood at this pixel?
// Shared by the passes that blur by it. Method, measurements: docs/inverse_warp.md.
//
//   inverse_depth, motion [, motion_back] --surfaces-> surfaces
//   surfaces --tile_surfaces-> tile_surfaces
//   tile_surfaces --starts--> starts; work lists: moving_blocks, still_blocks
//   color, surfaces, starts [, noise] --shutter--> color [, hint]     moving_blocks
//   color                             --keep-----> color [, hint]     still_blocks
//
// Sources: Yang et al., Image-Based Bidirectional Scene Reprojection, 2011; Bowles et al.,
// Iterative Image Warping, 2012.
#pragma once

#include "chain/pass.h"

namespace postchain::inverse_warp {

inline constexpr int kMaxStarts = 8;
inline constexpr int kLeastTimes = 5;  // per pixel, however short its path

struct ShutterSettings {
    double half_shutter = 0.25;   // half the open time, frames
    int samples = 25;             // times per pixel at most
    double path_px_per_time = 2;  // a pixel has a time for so many pixels of its tile's path
    int starts = 4;               // of a tile, beside the pixel's own; 1..kMaxStarts
    double max_path_px = 40;      // longest path on one side of the frame
    double still_limit_px = 0.5;  // a tile whose paths are no longer keeps its color
    double time_jitter = 0.5;     // largest shift of a pixel's times, in spacings; 0..1
    std::string still_rule;       // rule under which still blocks are found on the device
};

// What the pass made: its color, and its hint where one was wanted (-1 otherwise).
struct ShutterPlanes {
    TextureId color = -1;
    TextureId hint = -1;
};

// Of a filter whose paths are no longer than this.
Reach shutter_reach(double max_path_px);

// Adds the steps and textures above. Reads color, inverse_depth, motion and, where the frame has
// it, motion_back. `noise`: 128 x 128, y in [-1, 1) shifts a pixel's times; -1: no shift.
ShutterPlanes plan_shutter(PassPlanner& planner, const ShutterSettings& settings, TextureId noise);

}  // namespace postchain::inverse_warp
