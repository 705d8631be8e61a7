// Distributes bands of rows over threads. The distribution never changes the result: bands write
// their own rows, and sums are made afterwards in a fixed order.
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace postchain::metrics {

// Calls work(first row, end row) for bands of `band` rows. threads <= 0: one per core; fewer if not
// available. Rethrows exceptions of work after all threads have stopped.
inline void for_bands(int rows, int band, int threads, const std::function<void(int, int)>& work) {
    const int bands = (rows + band - 1) / band;
    if (threads <= 0) threads = std::max(1, int(std::thread::hardware_concurrency()));
    threads = std::min(threads, bands);
    std::atomic<int> next = 0;
    std::mutex mutex;
    std::exception_ptr thrown;
    const auto take = [&]() noexcept {
        try {
            for (int i = next++; i < bands; i = next++)
                work(i * band, std::min(rows, (i + 1) * band));
        } catch (...) {
            next = bands;
            const std::lock_guard lock(mutex);
            if (!thrown) thrown = std::current_exception();
        }
    };
    std::vector<std::jthread> helpers;
    try {
        helpers.reserve(size_t(std::max(threads, 0)));
        for (int i = 1; i < threads; ++i) helpers.emplace_back(take);
    } catch (const std::exception&) {  // no memory or thread: the existing threads do all work
    }
    take();
    helpers.clear();  // joins them
    if (thrown) std::rethrow_exception(thrown);
}

}  // namespace postchain::metrics
