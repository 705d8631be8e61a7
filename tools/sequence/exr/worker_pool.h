// Threads that pack and unpack pixels, shared by every reader and writer of the process.
//
//   run(count, work): the caller and whoever is free take the indices 0, 1, 2, ... one at a time
//
// The caller works too, and waits for no thread that has not begun: a reader and a writer that run
// at the same time do not hold each other up. Nothing is allocated for a run.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "chain/status.h"

namespace postchain::io {

class WorkerPool {
  public:
    // `slot` is less than slots(), and no other thread of the same run has it.
    using Work = std::function<Status(size_t index, size_t slot)>;

    static WorkerPool& shared();
    WorkerPool() = default;
    WorkerPool(const WorkerPool&) = delete;
    ~WorkerPool();

    // How many threads may work for one caller, itself included. Fewer where the system starts no
    // more.
    void set_threads(int threads);
    size_t slots() const { return slots_; }

    // Ends at the first failure: that of the lowest index, whatever the number of threads. `slots`:
    // how many the caller has prepared for, at least 1.
    Status run(size_t count, size_t slots, const Work& work);

  private:
    struct Run;
    void help();
    void take_all(Run& run, size_t slot);
    void stop();

    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable left_;
    Run* first_ = nullptr;  // runs that take more threads
    bool stopping_ = false;
    std::vector<std::thread> threads_;
    std::atomic<size_t> slots_ = 1;
};

}  // namespace postchain::io
