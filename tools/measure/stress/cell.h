// Cells of the stability matrix: frames in which widely separated scales meet in one
// neighborhood. How each hazard is handled: docs/stability.md.
//
// A row is one kind of stiffness (speeds, depth ratios, radiance, lens, sizes, non-finite values;
// "crossed": the worst of all of them at once), a cell one frame of it. Cells know no pass: they
// are canonical frames, and say what of them is still, in focus or soft, from which the checks
// conclude who must return every bit.
#pragma once

#include <string>
#include <vector>

#include "chain/frame.h"

namespace postchain::stress {

struct Cell {
    std::string row;   // "speed"
    std::string name;  // "object 0.499 px, ground still"
    FrameDescription frame;
    FramePlanes planes;
    bool reduced = false;   // stands in the reduced set too; every row has such cells
    bool still = false;     // no half-velocity is longer than 0.5 px
    bool in_focus = false;  // no circle of confusion has a radius of 0.5 px
    bool soft = false;      // no contrast above 1 %
    // Pixels with NaN or Inf that were put in, by plane, and what was found of them.
    bool checks_counts = false;
    uint64_t nonfinite_placed = 0;
    uint64_t nonfinite_counted = 0;

    // Have the planes of all these roles nothing for a pass to do (chain/promises.h)?
    bool is_quiet(RoleSet roles) const;
};

// Half the exposure's motion: with this shutter a half-velocity of v px is a motion of 2 v px.
inline constexpr double kShutterFrames = 1;

// All rows, or their cells of the reduced set. `tile_px` is r of the chain under test (check.h);
// the frames are 2 r x r pixels where the row does not say otherwise. Half-velocities, in pixels.
std::vector<Cell> make_cells(int tile_px, bool reduced);

}  // namespace postchain::stress
