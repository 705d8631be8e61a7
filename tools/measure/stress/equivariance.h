// Turns, moves and the dot: operations that filters commute with, and light that they keep.
//
//   turns  turned(filter(frame)) against filter(turned(frame)): mirror, flip, quarter turn
//   moves  two windows on the extended frame, one moved by s px: their overlap must be equal if
//          s is a whole number of tiles and boxes (shift), and is measured otherwise (grid)
//   dot    one bright pixel on black, with the center pixel's depth and motion everywhere
#pragma once

#include <array>
#include <optional>

#include "tools/measure/stress/measurement.h"

namespace postchain::stress {

class CellMeasurement final : public Measurement {
  public:
    using Measurement::Measurement;

  private:
    Status turns() override;
    Status shift() override;
    Status dot() override;

    bool fits_tiles() const;  // sides are multiples of r
    // The chain under test, or one with variants of its passes, that has this symmetry.
    std::optional<Chain> chain_with(Symmetry symmetry) const;
    // Remaining fraction of the dot's light in each channel; `out` gets the image.
    Result<std::array<double, 4>> light_left(const Chain& chain, const FramePlanes& dot,
                                             float value, ImageF& out);
};

}  // namespace postchain::stress
