// A thread with a queue of tasks: previews and thumbnails are read and encoded while a job filters
// its frames.
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
    // `most`: maximum number of waiting tasks.
    explicit ErrandThread(size_t most) : most_(most) {}
    ~ErrandThread();  // runs the waiting tasks first

    Status begin();  // errors (internal): the thread does not start
    // False, without taking the task, if too many wait. The task must not throw.
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
