// Timer queries of a device that answers late.
#include "chain/gl/clock.h"

#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/gpu.h"

namespace postchain {
namespace {

using ::testing::ElementsAre;

// Takes the place of GL's functions for queries while it exists: query number n is taken at
// n^2 ms, and `finished` says how many are available. An early look at a result fails the test.
class Queries {
  public:
    Queries() {
        test::executor();  // epoxy looks each function up once
        taken_.clear();
        finished = 0;
        epoxy_glCreateQueries = [](GLenum, GLsizei count, GLuint* names) {
            for (GLsizei i = 0; i < count; ++i) names[i] = ++made_;
        };
        epoxy_glDeleteQueries = [](GLsizei, const GLuint*) {};
        epoxy_glQueryCounter = [](GLuint name, GLenum) { taken_.push_back(name); };
        epoxy_glGetQueryObjectiv = [](GLuint name, GLenum, GLint* value) {
            *value = number_of(name) < finished;
        };
        epoxy_glGetQueryObjectui64v = [](GLuint name, GLenum, GLuint64* value) {
            const size_t number = number_of(name);
            EXPECT_LT(number, finished) << "waits for the device";
            *value = number * number * 1'000'000;
        };
    }
    ~Queries() {
        epoxy_glCreateQueries = create_;
        epoxy_glDeleteQueries = delete_;
        epoxy_glQueryCounter = counter_;
        epoxy_glGetQueryObjectiv = available_;
        epoxy_glGetQueryObjectui64v = result_;
    }

    static inline size_t finished = 0;

  private:
    static size_t number_of(GLuint name) {  // of the last time that it was taken
        return size_t(std::find(taken_.rbegin(), taken_.rend(), name).base() - taken_.begin()) - 1;
    }
    static inline std::vector<GLuint> taken_;
    static inline GLuint made_ = 0;
    const decltype(epoxy_glCreateQueries) create_ = epoxy_glCreateQueries;
    const decltype(epoxy_glDeleteQueries) delete_ = epoxy_glDeleteQueries;
    const decltype(epoxy_glQueryCounter) counter_ = epoxy_glQueryCounter;
    const decltype(epoxy_glGetQueryObjectiv) available_ = epoxy_glGetQueryObjectiv;
    const decltype(epoxy_glGetQueryObjectui64v) result_ = epoxy_glGetQueryObjectui64v;
};

std::vector<double> milliseconds_of(const Times& times) {
    std::vector<double> all;
    for (const auto& interval : times.intervals) all.push_back(interval.milliseconds);
    return all;
}

TEST(Clock, TimesAreDifferencesOfTimestamps) {
    const Queries queries;
    gl::Clock clock(gl::Device{});
    clock.begin(7, 70);
    clock.mark(0, "blur");
    clock.leave_out(0.25);  // of "edges"
    clock.mark(1, "edges");
    clock.mark(0, "blur", "gather");
    clock.mark(0, "blur");
    Queries::finished = 4;
    EXPECT_EQ(clock.newest(), nullptr) << "the last mark is not available";
    Queries::finished = 5;
    const Times* times = clock.newest();
    ASSERT_NE(times, nullptr);
    EXPECT_EQ(times->frame, 7u);
    EXPECT_THAT(milliseconds_of(*times), ElementsAre(1 + 7, 3 - 0.25, 5))
        << "as at 0, 1, 4, 9, 16 ms";
    EXPECT_EQ(times->intervals[2].name, "blur.gather");
}

TEST(Clock, TimesOfOnePassAndNameAreSummed) {
    const std::vector<Times::Interval> measured = {
        {0, "fxaa", 1}, {1, "fxaa", 2}, {1, "fxaa.luma", 4}, {0, "fxaa", 8}};
    Times times;
    for (int again = 0; again < 2; ++again) {
        times.add_up(measured);
        EXPECT_THAT(milliseconds_of(times), ElementsAre(1 + 8, 2, 4));
        EXPECT_EQ(times.intervals.at(1).pass, 1);
        EXPECT_EQ(times.intervals.back().name, "fxaa.luma");
    }
}

TEST(Clock, TheNewestFinishedSequenceCounts) {
    const Queries queries;
    gl::Clock clock(gl::Device{});
    for (uint64_t frame = 1; frame <= 20; ++frame) {
        clock.begin(frame, frame % 2);
        if (frame <= 10) clock.leave_out(0.5);  // of these frames alone
        clock.mark(0, "blur");
    }
    const auto newest = [&](std::initializer_list<uint64_t> tags) {
        const Times* times = clock.newest(std::vector<uint64_t>(tags));
        return times ? times->frame : 0;
    };
    EXPECT_EQ(newest({0, 1}), 0u);
    Queries::finished = 38;
    EXPECT_EQ(newest({0, 1}), 19u);
    EXPECT_EQ(newest({0}), 18u);
    EXPECT_THAT(milliseconds_of(*clock.newest()), ElementsAre(37 * 37 - 36 * 36));
    Queries::finished = 40;
    EXPECT_EQ(newest({1, 0}), 20u);
    clock.cancel();
    EXPECT_EQ(newest({0, 1}), 19u);
}

}  // namespace
}  // namespace postchain
