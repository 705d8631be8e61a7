// The state of the device, the disks and the store, which can be known only by waiting.
// Looked at once in a while on a thread of its own, so that any number of requests for it wait for
// nothing.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>

#include "tools/service/work/helper_threads.h"

namespace postchain::service {

struct WatchedHealth {
    Status device;      // of a test dispatch
    Status store;       // it is in its place
    std::string disks;  // faults of the folders; empty = none
    size_t queued = 0;  // waiting jobs
};

class HealthWatch {
  public:
    // `look` runs on the thread of this object, and in begin().
    explicit HealthWatch(std::function<WatchedHealth()> look);
    ~HealthWatch() { end(); }

    Status begin();  // looks for the first time
    size_t end();    // as of HelperThreads

    // The last state, and the seconds since then, 0 while looks are in time.
    WatchedHealth last(int64_t& late_s) const;

  private:
    using Clock = std::chrono::steady_clock;
    void loop();

    const std::function<WatchedHealth()> look_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    WatchedHealth last_;
    Clock::time_point looked_;
    bool ends_ = false;
    HelperThreads thread_;
};

}  // namespace postchain::service
