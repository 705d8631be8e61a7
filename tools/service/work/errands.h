// A thread that does one thing after the other, so that pictures are read and encoded beside the
// frames of a job.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "chain/status.h"

namespace postchain::service {

class ErrandThread {
  public:
    // `most`: that may wait.
    explicit ErrandThread(size_t most) : most_(most) {}
    ~ErrandThread();  // what waits is done first

    Status begin();  // errors (internal): no thread
    // False where too many wait; the errand is not taken. It throws nothing.
    bool run(std::function<void()> errand);

  private:
    void loop();
    const size_t most_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> errands_;
    bool ends_ = false;
    std::thread thread_;
};

}  // namespace postchain::service
