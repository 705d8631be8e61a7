// Threads whose tasks take turns, and the one that asks the disks.
#include "tools/service/work/helper_threads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "chain/base/stop.h"
#include "tools/service/work/health_watch.h"

namespace postchain::service {
namespace {

using namespace std::chrono_literals;

// Threads whose tasks wait for open().
class Turns : public testing::Test {
  protected:
    void begin(size_t threads, size_t waiting, std::chrono::milliseconds patience = 60s) {
        threads_ = std::make_unique<HelperThreads>(threads, waiting, patience);
        ASSERT_TRUE(threads_->begin().ok());
    }
    void TearDown() override {
        open();
        threads_.reset();
    }
    bool add(const std::string& share) {
        return threads_->run(
            [this, share] {
                {
                    const std::lock_guard lock(mutex_);
                    order_ += share;
                }
                opened_.wait();
            },
            {share, [this, share] { dropped_ += share; }});
    }
    void open() {
        if (!is_open_) gate_.set_value();
        is_open_ = true;
    }
    std::string order() {
        const std::lock_guard lock(mutex_);
        return order_;
    }
    void wait_for(size_t tasks) {
        for (int i = 0; i < 6000 && order().size() < tasks; ++i) std::this_thread::sleep_for(10ms);
        ASSERT_EQ(order().size(), tasks);
    }

    std::promise<void> gate_;
    std::shared_future<void> opened_ = gate_.get_future().share();
    bool is_open_ = false;
    std::mutex mutex_;
    std::string order_, dropped_;
    std::unique_ptr<HelperThreads> threads_;
};

TEST_F(Turns, SharesAlternate) {
    begin(1, 100);
    add("a");
    wait_for(1);
    for (int i = 0; i < 4; ++i) add("a");
    for (int i = 0; i < 2; ++i) add("b");
    add("c");
    open();
    wait_for(8);
    // The one that comes anew first; then whoever has waited longest.
    EXPECT_EQ(order(), "abcabaaa");
}

TEST_F(Turns, NoShareHasAllThreads) {
    begin(3, 100);
    for (int i = 0; i < 6; ++i) add("a");
    wait_for(2);
    std::this_thread::sleep_for(100ms);
    EXPECT_EQ(order(), "aa");
    add("b");
    wait_for(3);
    EXPECT_EQ(order(), "aab");
}

TEST_F(Turns, TheLastTaskOfTheLargestShareMakesWay) {
    begin(1, 4);
    add("a");
    wait_for(1);
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(add("a"));
    EXPECT_FALSE(add("a"));
    EXPECT_EQ(dropped_, "");
    EXPECT_TRUE(add("b"));
    EXPECT_TRUE(add("c"));
    EXPECT_EQ(dropped_, "aa");
    EXPECT_FALSE(add("b")) << "two of a, one of b";
    open();
    wait_for(5);
}

TEST_F(Turns, AShareThatMakesWayKeepsItsOtherTasks) {
    begin(1, 3);
    add("a");
    wait_for(1);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(add("b"));
    EXPECT_TRUE(add("c"));
    EXPECT_EQ(dropped_, "b");
    open();
    wait_for(4);
    EXPECT_EQ(order(), "abcb");
}

TEST_F(Turns, ThreadsThatHangAreCounted) {
    begin(2, 100, 50ms);
    add("a");
    wait_for(1);
    EXPECT_TRUE(threads_->alive());
    for (int i = 0; i < 500 && threads_->hanging() == 0; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(threads_->hanging(), 1u);
    // Each is replaced, up to a limit.
    for (int i = 0; i < 400 && threads_->alive(); ++i) {
        add("b" + std::to_string(i));
        std::this_thread::sleep_for(20ms);
    }
    EXPECT_FALSE(threads_->alive());
    EXPECT_GE(threads_->hanging(), 17u);
    open();
    for (int i = 0; i < 500 && threads_->hanging() > 0; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_TRUE(threads_->alive());
}

// It has given its place away, and does not so again at its end.
TEST_F(Turns, AThreadThatHangsIsNoneOfItsShare) {
    begin(2, 100, 1s);
    std::promise<void> late;
    threads_->run([&] { late.get_future().wait(); }, {"a"});
    for (int i = 0; i < 500 && threads_->hanging() == 0; ++i) std::this_thread::sleep_for(10ms);
    add("a");
    wait_for(1);
    late.set_value();
    for (int i = 0; i < 500 && threads_->hanging() > 0; ++i) std::this_thread::sleep_for(10ms);
    add("a");
    add("b");
    wait_for(2);
    EXPECT_EQ(order(), "ab") << "a has one of the two threads";
}

// Runs until it is stopped.
void compute_until(const std::atomic<bool>& stop) {
    while (!stop) continue;
}

TEST_F(Turns, AThreadThatComputesDoesNotHang) {
    begin(2, 100, 100ms);
    const auto stop = std::make_shared<std::atomic<bool>>(false);
    threads_->run([&] { compute_until(*stop); }, {"a", {}, stop});
    add("b");  // it waits
    wait_for(1);
    for (int i = 0; i < 500 && threads_->hanging() == 0; ++i) std::this_thread::sleep_for(10ms);
    // Many patiences later it is the only one still.
    for (int i = 0; i < 30; ++i) {
        ASSERT_LE(threads_->hanging(), 1u);
        std::this_thread::sleep_for(10ms);
    }
    // The one that waits was replaced, the other one was not.
    add("c");
    wait_for(2);
    EXPECT_TRUE(threads_->alive());
    *stop = true;
}

TEST_F(Turns, TasksThatWaitBehindBusyThreadsAreCounted) {
    begin(2, 100);
    add("a");
    wait_for(1);
    EXPECT_EQ(threads_->stalled(), 0ms) << "no task waits";
    add("a");
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(threads_->stalled(), 0ms) << "a thread is free for others";
    add("b");
    wait_for(2);
    std::this_thread::sleep_for(50ms);
    EXPECT_GE(threads_->stalled(), 50ms);
    open();
    wait_for(3);
    for (int i = 0; i < 500 && threads_->stalled() > 0ms; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(threads_->stalled(), 0ms);
}

TEST_F(Turns, TheEndStopsTasksThatCompute) {
    begin(1, 100);
    std::atomic<int> stopped = 0;
    std::promise<void> begun;
    for (int i = 0; i < 2; ++i) {
        const auto stop = std::make_shared<std::atomic<bool>>(false);
        threads_->run(
            [&, i] {
                if (i == 0) begun.set_value();
                while (!is_stopped()) continue;
                ++stopped;
            },
            {"a", {}, stop});
    }
    begun.get_future().wait();
    EXPECT_EQ(threads_->end(), 0u);
    EXPECT_EQ(stopped, 2) << "the one that ran and the one that waited";
}

TEST_F(Turns, ATaskAsksItsOwnFlag) {
    begin(2, 100);
    std::promise<bool> own, of_other;
    const auto stop = std::make_shared<std::atomic<bool>>(true);
    threads_->run([&] { own.set_value(is_stopped()); }, {"a", {}, stop});
    EXPECT_TRUE(own.get_future().get());
    threads_->run([&] { of_other.set_value(is_stopped()); }, {"b", {}, {}});
    EXPECT_FALSE(of_other.get_future().get());
    EXPECT_FALSE(is_stopped());
}

// Out of memory, for example.
TEST(Threads, AnExceptionEndsItsThreadAlone) {
    std::promise<void> begun;
    auto thread = start_thread([&] {
        begun.set_value();
        throw std::bad_alloc();
    });
    begun.get_future().wait();
    thread->join();
}

TEST(HealthWatches, EndWithoutADiskThatDoesNotAnswer) {
    std::promise<void> answers;
    std::promise<void> answered;
    // The thread uses it after the end of the test.
    static auto* const watch = new HealthWatch(
        {"quick", "slow"}, [] { return WatchedHealth(); }, 100ms,
        [&](const std::string& folder) -> std::string {
            if (folder == "quick") return "quick: the disk is full";
            answers.get_future().wait();
            answered.set_value();
            return "";
        });
    ASSERT_TRUE(watch->begin().ok());
    int64_t late_s = 0;
    EXPECT_THAT(watch->last(late_s).disks,
                testing::StartsWith("slow: the disk has not answered for "));
    EXPECT_GT(late_s, 0);
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(watch->end(), 1u) << "the thread still uses it";
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
    answers.set_value();
    answered.get_future().wait();
}

TEST(HealthWatches, NameEveryFaultAndOutliveExceptions) {
    std::atomic<int> looks = 0;
    HealthWatch watch(
        {"a", "b", "c"}, [] { return WatchedHealth(); }, 60s,
        [&](const std::string& folder) {
            if (looks++ == 0) throw std::bad_alloc();
            return folder == "b" ? std::string() : folder + ": no";
        });
    ASSERT_TRUE(watch.begin().ok());
    int64_t late_s = 0;
    for (int i = 0; i < 5000 && watch.last(late_s).disks.empty(); ++i)
        std::this_thread::sleep_for(1ms);
    EXPECT_EQ(watch.last(late_s).disks, "a: no; c: no");
    EXPECT_EQ(late_s, 0);
    EXPECT_EQ(trouble_of_folder("/nowhere"), "/nowhere: cannot be written");
}

}  // namespace
}  // namespace postchain::service
