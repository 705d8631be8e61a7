// Threads with a queue of tasks. A task may hang, in a read from a disk that does not answer: then
// its thread is lost, and another one takes its place.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "chain/base/status.h"

namespace postchain::service {

// Errors (internal): the system starts no more threads.
Result<std::thread> start_thread(std::function<void()> work);

class HelperThreads {
  public:
    // `most_waiting`: tasks. `patience`: a task that takes longer may have lost its thread.
    HelperThreads(size_t threads, size_t most_waiting,
                  std::chrono::milliseconds patience = std::chrono::seconds(60));
    ~HelperThreads();  // end()
    HelperThreads(const HelperThreads&) = delete;
    HelperThreads& operator=(const HelperThreads&) = delete;

    Status begin();  // errors (internal): a thread does not start
    // False, without taking the task, if too many wait. The task must not throw.
    bool run(std::function<void()> task);
    // Runs the waiting tasks, and ends the threads. Returns the number of threads whose task hangs:
    // what their tasks use must stay.
    size_t end();

  private:
    struct Inside;
    std::shared_ptr<Inside> inside_;  // also of the lost threads
};

}  // namespace postchain::service
