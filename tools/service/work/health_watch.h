// The state of the device, the disks and the store, which can be known only by waiting.
// Looked at once in a while on a thread of its own, so that any number of requests for it wait for
// nothing, and a disk that does not answer holds up that thread only.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

struct WatchedHealth {
    Status device = {};  // of a test dispatch
    std::string renderer = {};
    Status store = {};       // it is in its place
    size_t queued = 0;       // waiting jobs
    std::string disks = {};  // faults of the folders; empty = none
};

// Why files cannot be written to a folder; empty = they can.
std::string trouble_of_folder(const std::string& folder);

class HealthWatch {
  public:
    // `look` (without the disks) and `trouble_of` run on the thread of this object. A look that
    // takes longer than `late` has met a disk that does not answer.
    HealthWatch(
        std::vector<std::string> folders, std::function<WatchedHealth()> look,
        std::chrono::milliseconds late = std::chrono::seconds(15),
        std::function<std::string(const std::string& folder)> trouble_of = trouble_of_folder);
    ~HealthWatch() { end(); }

    Status begin();  // waits a second for the first look
    // Returns 1 if the thread hangs: what it uses must stay.
    size_t end();

    // The last state, and the seconds since then, 0 while looks are in time.
    WatchedHealth last(int64_t& late_s) const;

  private:
    using Clock = std::chrono::steady_clock;
    void loop();
    void look();

    const std::vector<std::string> folders_;
    const std::function<WatchedHealth()> look_;
    const std::chrono::milliseconds late_;
    const std::function<std::string(const std::string&)> trouble_of_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    WatchedHealth last_;
    std::string asked_;  // the folder that is asked
    Clock::time_point looked_ = Clock::now();
    bool busy_ = true, ends_ = false, ended_ = false;
    std::thread thread_;
};

}  // namespace postchain::service
