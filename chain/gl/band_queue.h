// Sizes the bands of a run by the time that they take, limits how many of them the device has
// before it, does other work while it waits for one, and checks before each whether to go on.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>

#include "chain/base/status.h"
#include "chain/gl/band_timer.h"
#include "chain/gl/fence.h"

namespace postchain {

// Whether a run goes on before its next band. The largest of several answers counts.
enum class RunDecision {
    go_on,
    wait,  // other work has the device: ask again
    stop,
};

// Must return at once. Called on the thread of the run.
using ContinueCallback = std::function<RunDecision()>;

}  // namespace postchain

namespace postchain::gl {

class BandQueue {
  public:
    // `software`: the renderer is. `timer` knows the rates of earlier runs. `ask` and `meanwhile`
    // may be empty.
    BandQueue(bool software, BandTimer& timer, ContinueCallback ask, Meanwhile meanwhile = {});
    ~BandQueue();
    BandQueue(const BandQueue&) = delete;
    BandQueue& operator=(const BandQueue&) = delete;

    // True if a count on the device can be read at no cost: a software renderer has run each
    // dispatch when the call returns.
    bool reads_counts() const { return software_; }
    // The dispatch that follows: its program, its fetches in a work group, and the rate that counts
    // at most.
    void begin_dispatch(unsigned program, double taps_of_group, double most_rate);
    // Fetches that its program makes in a millisecond.
    double rate() const { return timer_.rates.of(next_.program); }
    // Work groups that the next band may have.
    double groups() const { return groups_; }
    // Around the dispatch of a band. band_begins() waits for as long as other work has the device,
    // and lets the device finish its bands first. Errors: StatusCode::canceled if it is to stop.
    // band_ends() waits until the device has at most one band before it (a software renderer:
    // none). groups 0: unknown.
    Status band_begins();
    void band_ends(unsigned groups);
    // Time that bands have waited since the last call, with an idle device.
    double take_waited_ms() { return std::exchange(waited_ms_, 0); }

  private:
    using Clock = std::chrono::steady_clock;
    struct Queued {
        Fence fence;
        BandTimer::Span span;
        unsigned groups = 0;
        uint64_t dispatch = 0;
        unsigned program = 0;
        double taps_of_group = 0, most_rate = 0;
    };
    void wait_for_first();
    void resize(double groups_per_ms);
    void set_groups(double groups);

    const bool software_;
    BandTimer& timer_;
    const double least_;  // groups that the device works on at once
    ContinueCallback ask_;
    Meanwhile meanwhile_;
    std::deque<Queued> queued_;
    Queued next_;  // of the dispatch that was begun
    double groups_ = 1;
    double waited_ms_ = 0;
};

}  // namespace postchain::gl
