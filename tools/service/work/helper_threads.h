// Threads with a queue of tasks. A task may hang, in a read from a disk that does not answer: then
// its thread is lost, and another one takes its place. A task that computes keeps its thread,
// however long it takes: another thread would only share the processors with it. What may compute
// for long asks is_stopped() (chain/base/stop.h), which tells that nobody waits for it any more.
//
// Tasks belong to shares: users, or the addresses of clients without a name. The shares with
// waiting tasks take turns, and no share has all threads, so that whoever has few tasks waits for
// few.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "chain/base/status.h"

namespace postchain::service {

// A thread that an exception of `work` ends, and not the process. Errors (internal): the system
// starts no more threads.
Result<std::thread> start_thread(std::function<void()> work);

// Whose turn a task takes, what is called if it makes way for another one, and the flag that tells
// the task that nobody waits for it, which end() sets too.
struct TaskTurn {
    std::string share = {};
    std::function<void()> dropped = {};
    std::shared_ptr<std::atomic<bool>> stop = {};
};

class HelperThreads {
  public:
    // `most_waiting`: tasks. `patience`: a task whose thread has waited longer, for anything but a
    // processor, may have lost it.
    HelperThreads(size_t threads, size_t most_waiting,
                  std::chrono::milliseconds patience = std::chrono::seconds(60));
    ~HelperThreads();  // end()
    HelperThreads(const HelperThreads&) = delete;
    HelperThreads& operator=(const HelperThreads&) = delete;

    Status begin();  // errors (internal): a thread does not start
    // False, without taking the task, if too many wait; if they are of another share that has more
    // of them than this one, its last task makes way, whose `dropped` is called. Tasks must not
    // throw.
    bool run(std::function<void()> task, TaskTurn turn = {});
    // Threads that have waited longer than the patience.
    size_t hanging() const;
    // How long tasks have waited without one being begun; 0 if a thread is free or none waits.
    std::chrono::milliseconds stalled() const;
    // False if no thread is left that takes tasks, and none can take its place.
    bool alive() const;
    // Stops and runs the waiting tasks, and ends the threads. Returns the number of threads whose
    // task hangs: what their tasks use must stay.
    size_t end();

  private:
    struct Inside;
    std::shared_ptr<Inside> inside_;  // also of the lost threads
};

}  // namespace postchain::service
