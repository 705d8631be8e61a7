// Cells of the stability matrix: frames in which widely separated scales meet in one neighborhood.
// How each hazard is handled: docs/stability.md.
//
// A row is one kind of stiffness (speeds, depth ratios, radiance, lens, sizes, non-finite values,
// denormals; "crossed": the extremes of all of them at once), a cell one frame of it. Cells are
// canonical frames and independent of passes. They state whether they are still, in focus or soft,
// from which the checks deduce which passes must return the input bit for bit.
#pragma once

#include <string>
#include <vector>

#include "chain/frame/frame.h"

namespace postchain::stress {

struct MatrixCell {
    std::string row;   // "speed"
    std::string name;  // "object 0.499 px, ground still"
    FrameDescription frame;
    FramePlanes planes;
    bool reduced = false;   // also in the reduced set; every row has such cells
    bool still = false;     // no half-velocity is longer than 0.5 px
    bool in_focus = false;  // no circle of confusion has a radius of 0.5 px
    bool soft = false;      // no contrast above 1 %
    // Number of inserted pixels with NaN or Inf, by plane, and number found.
    bool checks_counts = false;
    uint64_t nonfinite_placed = 0;
    uint64_t nonfinite_counted = 0;

    // Whether the planes of all these roles leave a pass nothing to do (chain/pass/guarantees.h).
    bool is_quiet(RoleSet roles) const;
};

// Motion over half the exposure: with this shutter a half-velocity of v px is a motion of 2 v px.
inline constexpr double kShutterFrames = 1;

// All rows, or their cells of the reduced set. `tile_px` is r of the chain under test (check.h);
// frames are 2 r x r pixels unless the row sets a size. Half-velocities, in pixels.
std::vector<MatrixCell> make_cells(int tile_px, bool reduced);

}  // namespace postchain::stress
