// What every cell of the stability matrix is checked for (spec metrics.md, "Stability").
//
//   check        value                                                          must be
//   ------------ -------------------------------------------------------------- -----------------
//   finite       output values that are NaN or Inf                              0
//   range        how far an output leaves its channel's input range, relative   rounding
//   constant     part of the pixels of a constant picture that changed          0
//   identity     part of the pixels that changed where nothing should happen    0
//   lean         part of the pixels that differ when nothing is left out        0
//   mirror       part of the pixels where filter and mirror do not commute      0.01
//   reference    part of the pixels off the double-precision reference          0.01
//   color        relative mean change of the output per change of the color     4
//   motion       the same, per change of the motion                             r/4
//   depth        the same, per change of the depth                              4
//   counted      non-finite input pixels that were not counted                  0
//
// color, motion and depth are continuity, in the mean over all pixels but at most one in a hundred
// that jumps: a decision or a tap that rounds the other way moves one pixel by more than any
// multiple of eps. The largest jump, relative to the largest color, stands in the note of a check
// that fails.
#pragma once

#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/executor.h"
#include "tools/stress/cell.h"

namespace postchain::stress {

// A chain under test. The cell's camera is the only one: what the chain says of lens and shutter
// does not count.
struct Subject {
    std::string name;
    Chain chain;
};

enum class Verdict { ok, limit, failed };  // limit: outside the bound, known, and documented
const char* name_of(Verdict verdict);

struct Measured {
    std::string check;
    Verdict verdict = Verdict::ok;
    double value = 0;
    double bound = 0;
    std::string note;  // of what is not ok: where, or why it is a limit
};

// The names above, in that order.
const std::vector<std::string>& check_names();

// r of the chain: the largest `max_blur_px` of its passes, 40 when none has one.
int tile_px(const Chain& chain);
// The subject with the camera values of its chain and passes unset.
Subject with_cells_camera(Subject subject);

// All checks that apply. Errors: the chain cannot be planned on this frame, or GL fails.
Result<std::vector<Measured>> measure(Executor& executor, const Subject& subject, const Cell& cell,
                                      Precision precision);

}  // namespace postchain::stress
