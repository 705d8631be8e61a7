// Bands: parts of a dispatch. A desktop GPU is reset when one dispatch runs for about two seconds,
// and nothing can stop a dispatch that has begun. So a long one is cut into bands of work groups,
// each a dispatch of its own. Before each a run asks if it may go on (chain/gl/band_queue.h). A
// shader takes its place in the frame from shaders/common/first_group.glsl, and no bit changes.
#pragma once

#include <array>
#include <limits>
#include <map>

#include "chain/plan/plan.h"

namespace postchain {

// A step that takes longer than kBandMs is cut into bands. A band takes at least kLeastBandMs,
// except the last of a row or list, because each dispatch ends with the device idle for a moment.
inline constexpr double kBandMs = 50, kLeastBandMs = 20;
// Texture fetches in a millisecond of a program that was not measured: those of a small integrated
// GPU, with the arithmetic between them.
inline constexpr double kUnknownRate = 1e6;
// Texture fetches of the longest band of such a program.
inline constexpr double kBandTaps = kBandMs * kUnknownRate;
// A step that a list launches may have had little to do when it was measured: the slowest device
// then takes 16 times as long as expected, which is still less than a second.
inline constexpr double kMostListRate = 16 * kUnknownRate;

// Texture fetches in a millisecond, by program, as measured.
class BandRates {
  public:
    static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

    double of(unsigned program) const;  // kUnknownRate if it was not measured
    bool knows(unsigned program) const { return rates_.contains(program); }
    // The program made so many fetches. `most`: its rate counts at most so much.
    void add(unsigned program, double taps, double ms, double most = kNoLimit);
    void forget() { rates_.clear(); }

  private:
    std::map<unsigned, double> rates_;
};

// Work groups of the bands of a step of columns x rows groups: all, whole rows, or equal parts of a
// row.
double groups_of_band(unsigned columns, unsigned rows, double ms_of_group);

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

// How a recorded run, which nothing can stop, executes a step: launched by its list if that is
// certain to be short, otherwise in bands. If the length of a list is not known they cover every
// block that it can have, and work groups beyond its end return at once.
struct Launch {
    bool by_list = false;
    Bands bands{0, 0};
    double groups_of_band = 0;
    Band next() { return bands.next(groups_of_band); }
};
Launch launch_of(const Plan& plan, const Step& step);

// Whether it reads a texture that it also writes: each band then waits for the one before.
bool bands_wait(const Step& step);

}  // namespace postchain
