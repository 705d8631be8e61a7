// Operations that filters commute with, and light that they keep.
//   turns  turned(filter(frame)) against filter(turned(frame)): mirror, flip, quarter turn
//   shift  two windows on the extended frame, one moved by s px: their overlap must be equal if
//          s is a whole number of tiles and boxes (shift), and is measured otherwise (grid)
//   dot    one bright pixel on black, with the center pixel's depth and motion everywhere
#pragma once

#include "tools/stress/measurement.h"

namespace postchain::stress {

Status check_turns(Measurement& measured);
Status check_shift(Measurement& measured);
Status check_dot(Measurement& measured);

}  // namespace postchain::stress
