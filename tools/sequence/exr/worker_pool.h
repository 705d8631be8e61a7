// Threads that pack and unpack pixels, shared by every reader and writer of the process.
//
//   run(count, work): the caller and idle threads take the indices 0, 1, 2, ... one at a time
//
// The caller works too and does not wait for threads that have not started, so a reader and a
// writer that run at the same time do not block each other. A run allocates nothing.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "chain/base/status.h"

namespace postchain::io {

class WorkerPool {
  public:
    // `slot` is less than slots() and unique among the threads of a run.
    using Work = std::function<Status(size_t index, size_t slot)>;

    static WorkerPool& shared();
    WorkerPool() = default;
    WorkerPool(const WorkerPool&) = delete;
    ~WorkerPool();

    // Sets the number of threads for one caller, itself included. Fewer if the system starts no
    // more.
    void set_threads(int threads);
    size_t slots() const { return slots_; }

    // Stops at a failure and returns the one with the lowest index, for any number of threads.
    // `slots`: number of slots that the caller has prepared, at least 1.
    Status run(size_t count, size_t slots, const Work& work);

  private:
    struct Run;
    void help();
    void take_all(Run& run, size_t slot);
    void stop();

    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable left_;
    Run* first_ = nullptr;  // list of runs that take more threads
    bool stopping_ = false;
    std::vector<std::thread> threads_;
    std::atomic<size_t> slots_ = 1;
};

}  // namespace postchain::io
