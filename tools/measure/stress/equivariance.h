// Turns, moves and the dot: what the filters commute with, and what they keep.
//
//   turns  turned(filter(frame)) against filter(turned(frame)): mirror, flip, quarter turn
//   moves  two windows on the frame continued, one moved by s px: what both show must be equal
//          where s is a whole number of tiles and boxes (shift), and is measured where not (grid)
//   dot    one bright pixel in black under the middle pixel's depth and motion everywhere
#pragma once

#include <array>
#include <optional>

#include "tools/measure/stress/measurement.h"

namespace postchain::stress {

// A Measurement with all its checks.
class CellMeasurement final : public Measurement {
  public:
    using Measurement::Measurement;

  private:
    Status turns() override;
    Status shift() override;
    Status dot() override;

    bool fits_tiles() const;  // sides are multiples of r
    // The chain under test, or by variants of its passes, where it has this symmetry.
    std::optional<Chain> chain_with(Symmetry symmetry) const;
    // The light that is left of the dot in each channel, relative to it; `out` gets the picture.
    Result<std::array<double, 4>> light_left(const Chain& chain, const FramePlanes& dot,
                                             float value, ImageF& out);
};

}  // namespace postchain::stress
