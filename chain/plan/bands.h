// Bands: parts of a dispatch. A desktop GPU is reset when one dispatch runs for about two seconds,
// and nothing can stop a dispatch that has begun. So a long one is cut into bands of work groups,
// each a dispatch of its own. Before each a run asks if it may go on (chain/gl/band_queue.h). A
// shader takes its place in the frame from shaders/common/first_group.glsl, and no bit changes.
#pragma once

#include <array>

#include "chain/plan/plan.h"

namespace postchain {

// Texture fetches of the longest band: 50 ms of a small integrated GPU, which makes about 1e9 in a
// second, with the arithmetic between them.
inline constexpr double kBandTaps = 5e7;

// Texture fetches of one work group of the step, at most. At least one for each thread.
double taps_of_group(const Step& step);

// Work groups of a band: the rectangle of `count` groups that begins at group `first`.
struct Band {
    std::array<unsigned, 2> first, count;

    unsigned groups() const { return count[0] * count[1]; }
    bool operator==(const Band&) const = default;
};

// Cuts columns x rows work groups in row order.
class Bands {
  public:
    Bands(unsigned columns, unsigned rows) : columns_(columns), rows_(rows) {}
    bool more() const { return columns_ > 0 && next_[1] < rows_; }
    // The next band, of one to `groups` groups: whole rows, or a part of a row.
    Band next(double groups);

  private:
    unsigned columns_, rows_;
    std::array<unsigned, 2> next_ = {0, 0};
};

}  // namespace postchain
