// Measures how many texture fetches each program makes in a millisecond, from which the bands of
// its dispatches follow: by timer queries, and on a software renderer, whose dispatches have run
// when the call returns and whose timers are wrong, by the wall clock.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "chain/gl/device.h"
#include "chain/plan/bands.h"

namespace postchain::gl {

class BandTimer {
  public:
    explicit BandTimer(const Device& device);
    ~BandTimer();
    BandTimer(const BandTimer&) = delete;
    BandTimer& operator=(const BandTimer&) = delete;

    // Some dispatches.
    struct Span {
        unsigned begin = 0, end = 0;  // queries
        std::chrono::steady_clock::time_point begun;
        double wall_ms = 0;
    };
    Span begin();
    void end(Span& span);
    // The span's time; its queries serve others. Waits, unless the device has done it.
    double ms(const Span& span);

    // Measures a step without waiting: its time counts in a later run. True if one more can be
    // waited for.
    bool may_measure() const { return waiting_.size() < kMost; }
    void measure(const Span& span, unsigned program, double taps, double most_rate);
    void take();  // the times that are known by now

    BandRates rates;
    // As if no program had been measured.
    void forget();
    // Its queries went with their context.
    void abandon();

  private:
    static constexpr size_t kMost = 16;
    struct Waiting {
        Span span;
        unsigned program = 0;
        double taps = 0, most_rate = 0;
    };
    unsigned stamp();

    const bool software_;
    std::vector<unsigned> free_;
    std::vector<Waiting> waiting_;
};

}  // namespace postchain::gl
