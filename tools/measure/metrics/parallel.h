// Bands of rows over threads. Which thread takes which band never shows in the result: bands write
// rows of their own, and sums are made afterwards in one order.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace postchain::metrics {

// Calls work(first row, end row) for bands of `band` rows. threads <= 0: one per core.
inline void for_bands(int rows, int band, int threads, const std::function<void(int, int)>& work) {
    const int bands = (rows + band - 1) / band;
    if (threads <= 0) threads = std::max(1, int(std::thread::hardware_concurrency()));
    threads = std::min(threads, bands);
    std::atomic<int> next = 0;
    const auto take = [&] {
        for (int i = next++; i < bands; i = next++) work(i * band, std::min(rows, (i + 1) * band));
    };
    std::vector<std::thread> helpers;
    for (int i = 1; i < threads; ++i) helpers.emplace_back(take);
    take();
    for (auto& helper : helpers) helper.join();
}

}  // namespace postchain::metrics
