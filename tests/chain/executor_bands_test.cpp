// Long steps run in bands, between which the executor stops or waits.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>

#include "chain/plan/bands.h"
#include "tests/chain/executor_support.h"

namespace postchain {
namespace {

using test::Execute;

// Counts flushes while it exists.
class Flushes {
  public:
    Flushes() : original_(epoxy_glFlush) {
        count_ = 0;
        epoxy_glFlush = [] { ++count_; };
    }
    ~Flushes() { epoxy_glFlush = original_; }
    static int count() { return count_; }

  private:
    static inline int count_ = 0;
    const decltype(epoxy_glFlush) original_;
};

// In a host bands have the estimated size before a program is measured, and a dispatch that is
// short stays whole. The host's context is not flushed.
TEST_F(Execute, RunsALongStepInBands) {
    const Flushes flushes;
    ImageF pixels;
    const auto run = [&](uint64_t group_taps) {
        executor_->forget_rates();
        return executor_->run(counted(group_taps), {},
                              [&](const Step&, const PlanTexture&, const ImageF& result) {
                                  pixels = result;
                                  return Status();
                              });
    };
    ASSERT_TRUE(run(uint64_t(kBandTaps) / 16).ok());  // two rows, then what is left
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 7; ++x) {
            EXPECT_EQ(pixels.at(16 * x, 16 * y, 0), 7);
            EXPECT_EQ(pixels.at(16 * x, 16 * y, 1), y < 4 ? 2 : 1);
            EXPECT_EQ(pixels.at(16 * x + 15, 16 * y + 15, 2), x);
            EXPECT_EQ(pixels.at(16 * x + 15, 16 * y + 15, 3), y);
        }
    ASSERT_TRUE(run(uint64_t(kBandTaps) / 3).ok());  // 3, 3 and 1 of a row
    for (int x = 0; x < 7; ++x) EXPECT_EQ(pixels.at(16 * x, 16, 0), x < 6 ? 3 : 1);
    ASSERT_TRUE(run(1).ok());
    EXPECT_EQ(pixels.at(0, 0, 1), 5);
    EXPECT_EQ(pixels.at(16 * 6, 16 * 4, 3), 4) << "the place of the last band is taken back";
    EXPECT_EQ(flushes.count(), 0);
}

// In a host too: a step is cut because it takes long, not because it fetches much.
TEST_F(Execute, RemembersTheRateOfAProgram) {
    executor_->forget_rates();
    float columns = 0;
    const auto run = [&] {
        return executor_->run(counted(uint64_t(kBandTaps)), {},
                              [&](const Step&, const PlanTexture&, const ImageF& result) {
                                  columns = result.at(0, 0, 0);
                                  return Status();
                              });
    };
    ASSERT_TRUE(run().ok());
    EXPECT_EQ(columns, 1);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(run().ok());  // its time counts in a later run
    EXPECT_EQ(columns, 7);
}

TEST_F(Execute, BandsOfAKnownProgramAreFew) {
    executor_->forget_rates();
    int asked = 0;
    const ContinueScope scope(*executor_, [&] { return ++asked, RunDecision::go_on; });
    ASSERT_TRUE(executor_->filter(counted(uint64_t(kBandTaps)), {}).ok());
    const int unknown = asked;
    asked = 0;
    ASSERT_TRUE(executor_->filter(counted(uint64_t(kBandTaps)), {}).ok());
    EXPECT_LT(asked, unknown);
}

TEST_F(Execute, StopsBetweenBands) {
    std::atomic<bool> stop = false;
    {
        const StopScope scope(*executor_, &stop);
        EXPECT_TRUE(executor_->filter(counted(1), {}).ok());
        stop = true;
        const auto result = executor_->filter(counted(uint64_t(1) << 60), {});
        EXPECT_EQ(result.status().code(), StatusCode::canceled);
        const StopScope none(*executor_, nullptr);
        EXPECT_FALSE(executor_->filter(counted(1), {}).ok()) << "a scope outside counts too";
    }
    EXPECT_TRUE(executor_->filter(counted(1), {}).ok()) << "the scope has ended";
}

// The answer `wait` dispatches nothing, and its time is not the pass's.
TEST_F(Execute, WaitsForItsTurnBeforeEachBand) {
    constexpr int kWaits = 10;  // at least 1 ms each
    int asked = 0;
    executor_->set_timing(true);
    const auto start = std::chrono::steady_clock::now();
    ImageF pixels;
    {
        const ContinueScope scope(*executor_, [&] {
            return asked++ % (kWaits + 1) == kWaits ? RunDecision::go_on : RunDecision::wait;
        });
        auto result = executor_->filter(counted(uint64_t(1) << 60), {});
        ASSERT_TRUE(result.ok()) << result.status().message();
        pixels = std::move(result->at(Role::color));
    }
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    executor_->set_timing(false);
    // Each group's pixels have the size of its dispatch.
    double bands = 0;
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 7; ++x)
            bands += 1 / (pixels.at(16 * x, 16 * y, 0) * pixels.at(16 * x, 16 * y, 1));
    EXPECT_GT(asked, kWaits);
    EXPECT_EQ(asked, std::lround(bands) * (kWaits + 1));
    EXPECT_LE(executor_->pass_times().at(0).milliseconds, ms - std::lround(bands) * kWaits);
}

}  // namespace
}  // namespace postchain
