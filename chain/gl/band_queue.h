// Sizes the bands of a run by the time that they take, limits how many of them the device has
// before it, does other work while it waits for one, and checks before each whether to go on.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>

#include "chain/base/status.h"
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
    // `software`: the renderer is. `ask` and `meanwhile` may be empty.
    BandQueue(bool software, ContinueCallback ask, Meanwhile meanwhile = {});
    BandQueue(const BandQueue&) = delete;
    BandQueue& operator=(const BandQueue&) = delete;

    // True if a count on the device can be read at no cost: a software renderer has run each
    // dispatch when the call returns.
    bool reads_counts() const { return software_; }
    // The dispatch that follows has this many fetches in a work group.
    void begin_dispatch(double taps_of_group);
    // Work groups that the next band may have.
    double groups() const { return groups_; }
    // Around the dispatch of a band. band_begins() waits for as long as other work has the device,
    // and lets the device finish its bands first. Errors: StatusCode::canceled if it is to stop.
    // band_ends() waits until the device has at most one band before it (a software renderer:
    // none).
    Status band_begins();
    void band_ends(unsigned groups);
    // Time that bands have waited since the last call, with an idle device.
    double take_waited_ms() { return std::exchange(waited_ms_, 0); }

  private:
    using Clock = std::chrono::steady_clock;
    struct Queued {
        Fence fence;
        Clock::time_point begun;
        unsigned groups = 0;
        uint64_t dispatch = 0;
    };
    void wait_for_first();
    void resize(double groups_per_ms);

    const bool software_;
    const double least_;  // groups that the device works on at once
    ContinueCallback ask_;
    Meanwhile meanwhile_;
    std::deque<Queued> queued_;
    Clock::time_point begun_, last_;
    double groups_ = 1;
    double waited_ms_ = 0;
    uint64_t dispatch_ = 0;
};

}  // namespace postchain::gl
