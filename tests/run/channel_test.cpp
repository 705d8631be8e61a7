// Channel: a bounded queue between two threads.
#include "tools/sequence/run/channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace postchain::sequence {
namespace {

TEST(Channel, KeepsOrderAndBound) {
    Channel<int> channel(2);
    std::atomic<int> pushed = 0;
    std::thread writer([&] {
        for (int i = 0; i < 100; ++i) {
            EXPECT_TRUE(channel.push(i));
            ++pushed;
        }
        channel.close();
    });
    std::vector<int> got;
    do {
        // The writer fills the channel: the next value waits until one is taken.
        while (pushed < std::min(int(got.size()) + 2, 100)) std::this_thread::yield();
        EXPECT_LE(pushed, int(got.size()) + 2);
        if (auto value = channel.pop()) got.push_back(*value);
    } while (got.size() < 100);
    EXPECT_FALSE(channel.pop());
    writer.join();
    EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
}

TEST(Channel, CloseWakesBothSides) {
    Channel<std::unique_ptr<int>> full(1), empty(1);
    ASSERT_TRUE(full.push(std::make_unique<int>(1)));
    std::atomic<bool> dropped = false, ended = false;
    std::thread writer([&] { dropped = !full.push(std::make_unique<int>(2)); });
    std::thread reader([&] { ended = !empty.pop(); });
    full.close();
    empty.close();
    writer.join();
    reader.join();
    EXPECT_TRUE(dropped && ended);
    // Remaining values can still be taken.
    auto left = full.pop();
    ASSERT_TRUE(left);
    EXPECT_EQ(**left, 1);
    EXPECT_FALSE(full.pop());
    EXPECT_FALSE(full.try_pop());
}

}  // namespace
}  // namespace postchain::sequence
