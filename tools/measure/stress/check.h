// What every cell of the stability matrix is checked for (spec metrics.md, "Stability").
//
//   check        value                                                          must be
//   ------------ -------------------------------------------------------------- -----------------
//   finite       output values that are NaN or Inf                              0
//   range        how far an output leaves its channel's input range, relative   the promise
//   constant     part of the pixels of a constant picture that changed          0
//   identity     part of the pixels that changed where nothing should happen    0
//   elided       part of the pixels that differ without elision                 0
//   repeat       part of the pixels that differ when the same is run again      0
//   mirror       mean error when filter and mirror change places                1e-4, fp16 5e-3
//   flip         the same, top and bottom                                       the same
//   turn         the same, a quarter turn                                       the same
//   shift        part of the pixels that differ after a move by whole tiles     0
//   grid         mean change after moves by parts of a tile                     0.05
//   dot          part of the light of a dot that is lost or won                 rounding
//   reference    mean error against the double-precision reference              the same
//   color        relative mean change of the output per change of the color     4
//   motion       the same, per change of the motion                             r/4
//   depth        the same, per change of the depth                              4
//   counted      non-finite input pixels that were not counted                  0
//
// mirror, flip, turn and reference average the relative errors of all pixels but those off by more
// than the tolerance (fp32 1e-3, fp16 2e-2), while these are at most one in a hundred: taps and
// ties that round the other way. A relative error is |a - b| over the larger of |a|, |b| and 1e-4
// of the largest color: 2 at most. grid is the sum of |a - b| over the larger sum of colors.
//
// range to dot are checked of the chains that promise them (chain/promises.h): of a pass that does
// not as it is set, the first variant that does stands in, and where there is none the check does
// not apply. mirror to grid ask for sides that are multiples of r; shift and grid are on the frame
// continued beyond its borders, at which alone a move may show; dot is under one depth and one
// motion, those of the cell's middle pixel, where a pass may lose light if it does not promise to
// keep it, but win none.
//
// A half holds 65504 at most: under fp16, range, constant and reference get the input as a half
// file would bring it.
//
// color, motion and depth are continuity, in the mean over all pixels but at most one in a hundred
// that jumps: a decision or a tap that rounds the other way moves one pixel by more than any
// multiple of eps. The largest jump, relative to the largest color, stands in the note of a check
// that fails.
#pragma once

#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/gl/executor.h"
#include "tools/measure/stress/cell.h"
#include "tools/measure/stress/limits.h"

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
    std::string note;                   // of what is not ok: where, and how much else
    const KnownLimit* limit = nullptr;  // of Verdict::limit
};

// What a check looked at: four channels each, but for the error.
struct Exhibit {
    std::string check;
    ImageF input;
    ImageF result;
    ImageF compared;
    ImageF error;             // one channel
    std::string compared_is;  // "double-precision reference"
    std::string error_is;     // "relative error"
};

struct CellMeasures {
    std::vector<Measured> checks;
    uint64_t bits = 0;  // hash of every bit of the output
};

struct CheckRow {
    std::string name;
    std::string help;  // what its value is
};
// The checks above, in that order; and their names alone.
const std::vector<CheckRow>& check_rows();
const std::vector<std::string>& check_names();

// r: the edge of the grid that the chain is tied to, or where that is finer than 16 px, its
// multiple next to 40.
int tile_px(const Chain& chain);
// The subject with the camera values of its chain and passes unset.
Subject with_cells_camera(Subject subject);

// All checks that apply; with `exhibits`, what each of them looked at. Errors: the chain cannot be
// planned on this frame, or GL fails.
Result<CellMeasures> measure(Executor& executor, const Subject& subject, const Cell& cell,
                             Precision precision, std::vector<Exhibit>* exhibits = nullptr);

}  // namespace postchain::stress
