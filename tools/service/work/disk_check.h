// Whether folders can be written. A disk that does not answer holds up its own thread only.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include "tools/service/work/helper_threads.h"

namespace postchain::service {

class DiskCheck {
  public:
    explicit DiskCheck(std::vector<std::string> folders);
    Status begin() { return thread_.begin(); }
    size_t end() { return thread_.end(); }

    // The faults of the folders; empty = none. Waits a second for a new result; later it says which
    // folder does not answer.
    std::string fault();

  private:
    using Clock = std::chrono::steady_clock;
    void check();

    const std::vector<std::string> folders_;
    std::mutex mutex_;
    std::condition_variable checked_;
    bool busy_ = false;
    Clock::time_point began_;
    std::string checking_;  // the folder
    std::string fault_;     // the last result
    HelperThreads thread_;
};

}  // namespace postchain::service
