// Which frames a watch takes, and when. The feed asks `given_up` between any two of its looks at
// the folder: there the tests write files.
#include "tools/sequence/run/frame_feed.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "tests/io/exr_files.h"
#include "tests/run/fixture.h"
#include "tests/support/status.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence::watch_feed_test {
namespace {

namespace fs = std::filesystem;

class WatchFeedTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.watch = Watch();
        fs::create_directory(at("rendered"));
    }
    // The bytes of a frame that is not in the folder.
    std::string rendered(int frame, const test::FrameFile& file = {}) {
        const std::string path = at(concat("rendered/", frame, ".exr"));
        test::write_frame(path, test::make_planes(48, 32, frame), file);
        return test::read_text(path);
    }
    void write(int frame, const test::FrameFile& file = {}) {
        test::write_text(in(frame), rendered(frame, file));
    }
    void start(const char* range) {
        if (range) frames(range);
        std::vector<int> gaps;
        auto tasks = plan_tasks(settings_, true, gaps);
        ASSERT_TRUE(tasks.ok()) << tasks.status().message();
        feed_ = std::make_unique<WatchFeed>(std::move(*tasks), settings_,
                                            std::chrono::milliseconds(100));
        reader_ = std::make_unique<SequenceReader>(settings_.source, settings_.input,
                                                   [this](const FrameHeader&) { return reads_; });
    }
    // The next frame; `between` runs between looks, and ends the wait with true. At most 20 s.
    std::optional<FrameFeed::Fed> next(const std::function<bool()>& between = [] {
        return false;
    }) {
        int calls = 0;  // 50 ms apart
        return feed_->next(*reader_, [&] { return between() || ++calls > 400; });
    }
    bool waits_for(const char* words) const {
        return feed_->waits_for().find(words) != std::string::npos;
    }

    RoleSet reads_ = {Role::color};
    std::unique_ptr<WatchFeed> feed_;
    std::unique_ptr<SequenceReader> reader_;
};

TEST_F(WatchFeedTest, OnlyCompleteFilesAreTakenAndTheOthersAreNamed) {
    write(1);
    const std::string two = rendered(2), three = rendered(3);
    test::write_text(in(2), two.substr(0, two.size() - 100));  // its writer was killed
    const size_t table = test::chunk_table_of(three, 2);       // written last
    test::write_text(in(3),
                     three.substr(0, table) + std::string(16, '\0') + three.substr(table + 16));
    test::write_text(in(4), "");
    write(6);
    settings_.watch->idle_s = 0.2;
    start("1-6");
    bool waited = false;
    for (const int frame : {1, 6}) {
        const auto fed = next([&] {
            waited |= waits_for("incomplete: 1");
            return false;
        });
        ASSERT_TRUE(fed);
        EXPECT_EQ(fed->task.frame, frame);
        EXPECT_TRUE(fed->missing.ok()) << fed->missing.message();
        EXPECT_EQ(feed_->waits_for(), "");
    }
    EXPECT_TRUE(waited) << "a file is complete at its second look at the earliest";
    for (const int frame : {2, 3, 4, 5}) {
        const auto fed = next();
        ASSERT_TRUE(fed);
        EXPECT_EQ(fed->task.frame, frame);
        EXPECT_EQ(fed->missing.code(), StatusCode::input);
        EXPECT_NE(fed->missing.message().find(in(frame)), std::string::npos)
            << fed->missing.message();
    }
    EXPECT_FALSE(next());
}

TEST_F(WatchFeedTest, AFrameNeedsEachOfItsFilesToBeComplete) {
    const auto depth_in = [&](const char* name) {
        settings_.input = test::must(
            io::InputSpec::parse(concat("color=", at("in.####.exr"), ",depth=", at(name))));
    };
    depth_in("z.####.exr");
    write(1);
    const std::string depth = rendered(1);
    test::write_text(at("z.0001.exr"), depth.substr(0, depth.size() - 100));
    start("1");
    EXPECT_FALSE(next([&] { return waits_for("incomplete: 1"); }));
    settings_.watch->idle_s = 0.3;
    auto fed = next();
    ASSERT_TRUE(fed);
    EXPECT_NE(fed->missing.message().find("z.0001.exr"), std::string::npos)
        << fed->missing.message();
    // One file may serve all frames.
    test::write_text(at("z.exr"), depth);
    depth_in("z.exr");
    start("1");
    fed = next();
    ASSERT_TRUE(fed);
    EXPECT_TRUE(fed->missing.ok()) << fed->missing.message();
}

TEST_F(WatchFeedTest, AFileWhoseTimeChangesIsNotTakenAndKeepsTheWatchFromEnding) {
    write(1);
    start("1");
    settings_.watch->idle_s = 0.2;
    auto time = fs::last_write_time(in(1));
    int looks = 0;
    const auto fed = next([&] {
        // Each call is 50 ms later at least: several looks and more than the idle time.
        if (++looks <= 10) fs::last_write_time(in(1), time += std::chrono::seconds(1));
        return false;
    });
    ASSERT_TRUE(fed);
    EXPECT_TRUE(fed->missing.ok()) << fed->missing.message();
    EXPECT_GT(looks, 10);
}

TEST_F(WatchFeedTest, AFileThatChangesAfterItsCheckIsCheckedAgain) {
    write(1);
    write(2);
    start("1-2");
    ASSERT_TRUE(next());
    // Frame 2 was complete at the last look.
    const std::string two = rendered(2);
    test::write_text(in(2), two.substr(0, two.size() / 2));
    EXPECT_FALSE(next([&] { return waits_for("incomplete: 2"); }));
}

TEST_F(WatchFeedTest, AFrameWaitsForNeighborsThatItReadsAndThatWillCome) {
    test::FrameFile still;  // its vectors follow from the cameras of three frames
    still.motion = false;
    still.attributes["worldToCamera"] = std::string("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1");
    struct Case {
        const char* name;
        RoleSet reads;
        test::FrameFile file;
        bool waits;
    };
    const Case cases[] = {{"color of the next", {Role::color, Role::color_after}, {}, true},
                          {"camera of the next", {Role::color, Role::motion}, still, true},
                          {"nothing of it", {Role::color}, {}, false}};
    for (const Case& one : cases) {
        SCOPED_TRACE(one.name);
        for (int frame : {1, 2}) fs::remove(in(frame));
        reads_ = one.reads;
        write(1, one.file);
        start("1-2");
        bool waited = false;
        auto fed = next([&] {
            if (waited || !waits_for("neighboring frame: 1")) return false;
            write(2, one.file);
            return !(waited = true);
        });
        ASSERT_TRUE(fed);
        EXPECT_EQ(fed->task.frame, 1);
        ASSERT_EQ(waited, one.waits);
        if (!waited) write(2, one.file);
        // No frame 3 will come.
        fed = next();
        ASSERT_TRUE(fed);
        EXPECT_EQ(fed->task.frame, 2);
        EXPECT_TRUE(fed->missing.ok()) << fed->missing.message();
    }
}

TEST_F(WatchFeedTest, NeighborsAcrossACutAreNotWaitedFor) {
    for (const bool cut : {true, false})
        for (const auto& [neighbor, frame] :
             {std::pair(Role::color_after, 1), {Role::color_before, 2}}) {
            for (int number : {1, 2}) fs::remove(in(number));
            settings_.source.cuts = {cut ? 1 : frame == 1 ? 0 : 2};
            reads_ = {Role::color, neighbor};
            write(frame);
            start("1-2");
            const auto fed = next([&] { return waits_for("neighboring frame"); });
            EXPECT_EQ(fed.has_value(), cut) << frame;
        }
}

// Frames of another part of the job, and frames that no job asked for and that are being written.
TEST_F(WatchFeedTest, NeighborsOutsideOfTheFramesAreWaitedForIfTheyWillCome) {
    reads_ = {Role::color, Role::color_after};
    write(1);
    for (const bool in_chunk : {true, false}) {
        SCOPED_TRACE(in_chunk);
        fs::remove(in(2));
        settings_.chunk = in_chunk ? io::Chunk{1, 2} : io::Chunk();
        if (!in_chunk) test::write_text(in(2), rendered(2).substr(0, 500));
        start(in_chunk ? "1-2" : "1");
        bool waited = false;
        const auto fed = next([&] {
            if (waited || !waits_for("neighboring frame: 1")) return false;
            write(2);
            return !(waited = true);
        });
        ASSERT_TRUE(fed);
        EXPECT_EQ(fed->task.frame, 1);
        EXPECT_TRUE(waited);
        EXPECT_FALSE(next()) << "only one frame is asked for";
    }
}

// The neighbor's writer was killed: the frame is filtered without it when the idle time is over.
TEST_F(WatchFeedTest, ANeighborThatStaysIncompleteIsNotWaitedForToTheEnd) {
    for (const auto& [neighbor, whole, damaged] :
         {std::tuple(Role::color_after, 1, 2), {Role::color_before, 2, 1}}) {
        reads_ = {Role::color, neighbor};
        settings_.watch->idle_s = 0.2;
        write(whole);
        test::write_text(in(damaged), rendered(damaged).substr(0, 500));
        start("1-2");
        const auto first = next(), second = next();
        ASSERT_TRUE(first && second);
        EXPECT_EQ(first->task.frame, whole);
        EXPECT_TRUE(first->missing.ok()) << first->missing.message();
        EXPECT_EQ(second->task.frame, damaged);
        EXPECT_EQ(second->missing.code(), StatusCode::input);
        EXPECT_FALSE(next());
    }
}

TEST_F(WatchFeedTest, WithoutARangeEveryFrameThatComesIsTaken) {
    write(3);
    start(nullptr);
    auto fed = next();
    ASSERT_TRUE(fed);
    EXPECT_EQ(fed->task.frame, 3);
    write(1);
    fed = next();
    ASSERT_TRUE(fed);
    EXPECT_EQ(fed->task.frame, 1);
    EXPECT_FALSE(next([] { return true; }));
    EXPECT_EQ(feed_->total(), 2u);
}

}  // namespace
}  // namespace postchain::sequence::watch_feed_test
