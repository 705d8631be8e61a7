#include "tools/sequence/exr/worker_pool.h"

#include <algorithm>
#include <system_error>

namespace postchain::io {

// All but `next_index` is guarded by the pool's mutex.
struct WorkerPool::Run {
    const Work& work;
    const size_t count;
    const size_t slots;
    std::atomic<size_t> next_index = 0;
    size_t taken_slots = 1;  // the caller has slot 0
    size_t helpers = 0;      // at work
    size_t failed_index = 0;
    Status failure;
    Run* after = nullptr;
};

WorkerPool& WorkerPool::shared() {
    static WorkerPool pool;
    return pool;
}

WorkerPool::~WorkerPool() {
    stop();
}

void WorkerPool::stop() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
    stopping_ = false;
}

void WorkerPool::set_threads(int threads) {
    stop();
    try {
        while (int(threads_.size()) + 1 < threads) threads_.emplace_back([this] { help(); });
    } catch (const std::system_error&) {
        // The caller's thread does all work if no other starts.
    }
    slots_ = threads_.size() + 1;
}

void WorkerPool::help() {
    std::unique_lock lock(mutex_);
    while (true) {
        Run* run = nullptr;
        wake_.wait(lock, [&] {
            run = first_;
            while (run != nullptr && run->taken_slots >= run->slots) run = run->after;
            return stopping_ || run != nullptr;
        });
        if (stopping_) return;
        const size_t slot = run->taken_slots++;
        ++run->helpers;
        lock.unlock();
        take_all(*run, slot);
        lock.lock();
        if (--run->helpers == 0) left_.notify_all();
    }
}

void WorkerPool::take_all(Run& run, size_t slot) {
    for (size_t index; (index = run.next_index++) < run.count;) {
        Status status;
        try {
            status = run.work(index, slot);
        } catch (...) {
            status = status_of_exception("packing pixels");
        }
        if (status.ok()) continue;
        // Lower indices have already been taken, and their threads finish them.
        run.next_index = run.count;
        const std::lock_guard lock(mutex_);
        if (!run.failure.ok() && run.failed_index < index) continue;
        run.failed_index = index;
        run.failure = std::move(status);
    }
}

Status WorkerPool::run(size_t count, size_t slots, const Work& work) {
    Run run{.work = work, .count = count, .slots = std::min(slots, count), .failure = {}};
    const bool shared = run.slots > 1;
    if (shared) {
        {
            const std::lock_guard lock(mutex_);
            run.after = first_;
            first_ = &run;
        }
        wake_.notify_all();
    }
    take_all(run, 0);
    if (shared) {
        std::unique_lock lock(mutex_);
        Run** at = &first_;
        while (*at != &run) at = &(*at)->after;
        *at = run.after;
        left_.wait(lock, [&] { return run.helpers == 0; });
    }
    return std::move(run.failure);
}

}  // namespace postchain::io
