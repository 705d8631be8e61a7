#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <new>
#include <set>
#include <thread>
#include <vector>

#include "tools/sequence/exr/worker_pool.h"

namespace postchain::io {
namespace {

// Waits for a state that another thread brings about; false if it does not within two minutes.
template <class Condition>
bool wait_for(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (!condition() && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    return condition();
}

TEST(WorkerPool, EveryIndexOnceOnSlotsOfItsOwn) {
    WorkerPool pool;
    for (const int threads : {0, 1, 2, 4, 1}) {
        pool.set_threads(threads);
        EXPECT_EQ(pool.slots(), size_t(std::max(threads, 1)));
        for (const size_t slots : {pool.slots(), std::min(size_t(2), pool.slots())})
            for (const size_t count : {size_t(0), size_t(1), size_t(3), size_t(1000)}) {
                std::vector<std::atomic<int>> seen(count), busy(slots);
                const Status status = pool.run(count, slots, [&](size_t index, size_t slot) {
                    EXPECT_LT(slot, slots);
                    EXPECT_EQ(busy[slot]++, 0);
                    ++seen[index];
                    --busy[slot];
                    return Status();
                });
                EXPECT_TRUE(status.ok());
                for (const auto& times : seen) EXPECT_EQ(times, 1);
            }
    }
}

TEST(WorkerPool, OthersHelpTheCaller) {
    WorkerPool pool;
    pool.set_threads(3);
    std::mutex mutex;
    std::set<std::thread::id> threads;
    std::atomic<int> inside = 0;
    const Status status = pool.run(3, 3, [&](size_t, size_t) {
        {
            const std::lock_guard lock(mutex);
            threads.insert(std::this_thread::get_id());
        }
        ++inside;
        // Each waits for the others, so fewer threads would never finish.
        EXPECT_TRUE(wait_for([&] { return inside == 3; }));
        return Status();
    });
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(threads.size(), 3u);
    EXPECT_TRUE(threads.contains(std::this_thread::get_id()));
}

TEST(WorkerPool, TheFailureOfTheLowestIndex) {
    WorkerPool pool;
    for (const int threads : {1, 4}) {
        pool.set_threads(threads);
        for (int round = 0; round < 10; ++round) {
            std::atomic<size_t> done = 0;
            std::atomic<bool> both = threads == 1;
            const Status status = pool.run(100000, pool.slots(), [&](size_t index, size_t) {
                ++done;
                // The lowest index fails alternately first and last, after another has started.
                if (index == 21) both = true;
                if (index == 20) {
                    EXPECT_TRUE(wait_for([&] { return both.load(); }));
                }
                if (index == (round % 2 == 0 ? 20 : 21))
                    std::this_thread::sleep_for(std::chrono::milliseconds(1));
                if (index < 20) return Status();
                return Status(StatusCode::input, concat("index ", index));
            });
            EXPECT_EQ(status.message(), "index 20");
            EXPECT_LT(done, 100000u);
        }
    }
}

TEST(WorkerPool, WhatIsThrownIsAFailure) {
    WorkerPool pool;
    pool.set_threads(2);
    const Status status = pool.run(10, 2, [](size_t, size_t) -> Status { throw std::bad_alloc(); });
    EXPECT_EQ(status.code(), StatusCode::memory);
}

// A reader and a writer do not wait for each other's queued work.
TEST(WorkerPool, TwoCallersAtOnce) {
    WorkerPool pool;
    pool.set_threads(2);
    std::atomic<bool> first_runs = false, second_done = false;
    std::thread first([&] {
        const Status status = pool.run(2, 2, [&](size_t, size_t) {
            first_runs = true;
            return wait_for([&] { return second_done.load(); })
                       ? Status()
                       : Status(StatusCode::internal, "the second waited");
        });
        EXPECT_TRUE(status.ok()) << status.message();
    });
    while (!first_runs) std::this_thread::yield();
    std::atomic<int> sum = 0;
    EXPECT_TRUE(pool.run(1000, 2, [&](size_t, size_t) { return ++sum, Status(); }).ok());
    second_done = true;
    first.join();
    EXPECT_EQ(sum, 1000);
}

}  // namespace
}  // namespace postchain::io
