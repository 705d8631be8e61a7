// The checks of every cell of the stability matrix (docs/stability.md, "Conditions").
//
//   check        value                                                          bound
//   ------------ -------------------------------------------------------------- -----------------
//   finite       output values that are NaN or Inf                              0
//   range        distance of an output from its channel's input range, relative the guarantee
//   constant     fraction of the pixels of a constant image that changed        0
//   identity     fraction of the pixels that changed without reason             0
//   elided       fraction of the pixels that differ without elision             0
//   repeat       fraction of the pixels that differ in a second run             0
//   mirror       mean error when filter and mirror are exchanged                1e-4, fp16 5e-3
//   flip         as mirror, top and bottom                                      as mirror
//   turn         as mirror, a quarter turn                                      as mirror
//   shift        fraction of the pixels that differ after a move by whole tiles 0
//   grid         mean change after moves by parts of a tile                     0.05
//   dot          fraction of the light of a dot that is lost or gained          rounding
//   reference    mean error against the double-precision reference              as mirror
//   color        relative mean change of the output per change of the color     4
//   motion       as color, per change of the motion                             r/4
//   depth        as color, per change of the depth                              4
//   noise        as color, per pixel of noise on vectors that are 0             1
//   counted      non-finite input pixels that were not counted                  0
//
// mirror, flip, turn and reference average relative errors. They exclude pixels with an error above
// the tolerance (fp32 1e-3, fp16 2e-2) if these are at most 1 %: taps and ties that round
// differently. A relative error is |a - b| divided by the maximum of |a|, |b| and 1e-4 of the
// largest color; it is at most 2. grid is the sum of |a - b| divided by the larger sum of colors.
//
// color, motion and depth are relative condition numbers: |change of the output| / |output| over
// |change of the input| / |input|, in the norm of the mean. noise is one at 0, where the input's
// change has no relative size: it adds 1e-3 px, in cells with vectors that are 0.
//
// range to dot are checked only for chains that guarantee them (chain/pass/guarantees.h). If a pass
// lacks a guarantee with its settings, its first variant with the guarantee is used; without one
// the check does not apply. mirror to grid need sides that are multiples of r. shift and grid
// extend the frame beyond its borders, because borders may depend on position. dot uses the depth
// and motion of the cell's center pixel everywhere; a pass that does not guarantee to keep light
// may lose it but not gain it.
//
// A half holds at most 65504: under fp16, range, constant and reference get the input as a half
// file would store it.
//
// The change of depth is eps or, behind a steep lens, the part of it that changes a radius in focus
// by a quarter of a pixel: a larger one exchanges a sharp pixel for a blurred one, and then the
// value is 1/eps, not a slope.
//
// color, motion, depth and noise measure continuity as a mean over all pixels, without the pixels
// that jump if these are at most 1 %: a decision or tap that rounds differently changes a pixel by
// more than any multiple of eps. The note of a failed check states the largest jump, relative to
// the largest color.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "tools/stress/cell.h"
#include "tools/stress/limits.h"

namespace postchain::stress {

// A chain under test. Only the cell's camera is used: the chain's lens and shutter values are
// ignored.
struct Subject {
    std::string name;
    Chain chain;
};

enum class Verdict { ok, limit, failed };  // limit: outside the bound, known and documented
const char* name_of(Verdict verdict);

struct Measured {
    std::string check;
    Verdict verdict = Verdict::ok;
    double value = 0;
    double bound = 0;
    std::string note;                   // unless ok: position, and other findings
    const KnownLimit* limit = nullptr;  // for Verdict::limit
};

// Images of a check: four channels each, one for the error.
struct CheckImages {
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
    std::string help;  // meaning of its value
};
// The checks above in this order; and their names.
const std::vector<CheckRow>& check_rows();
const std::vector<std::string>& check_names();

// r: the size of the grid that the chain depends on; below 16 px, its multiple closest to 40.
int tile_px(const Chain& chain);
// The subject, with the camera values of its chain and passes unset.
Subject with_cells_camera(Subject subject);

// All checks that apply, or those of `only`, if it is not empty; `images` gets the images of
// each. Errors: the chain cannot be planned for this frame, or GL fails.
Result<CellMeasures> measure(Executor& executor, const Subject& subject, const MatrixCell& cell,
                             Precision precision, std::vector<CheckImages>* images = nullptr,
                             const std::set<std::string>& only = {});

}  // namespace postchain::stress
