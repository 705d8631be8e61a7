// Files that are opened: lists of folders, what a dropped file is, and frames that are kept.
#include "tools/apps/view/files.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <set>
#include <thread>
#include <tuple>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/apps/view/frame_store.h"
#include "tools/apps/view/result_store.h"

namespace postchain::view {
namespace {

class FilesTest : public testing::Test {
  protected:
    void SetUp() override {
        for (const char* name : {"shot.0001.exr", "shot.0002.exr", "shot.0010.exr", "still_2.exr",
                                 "chain.yaml", "camera.json", ".hidden.exr", "notes.txt"})
            test::write_text(folder_.path(name), "");
        std::filesystem::create_directory(folder_.path("b"));
        std::filesystem::create_directory(folder_.path("a"));
    }
    test::TempFolder folder_;
};

TEST_F(FilesTest, AFolderListsSequences) {
    const auto rows = list_folder(folder_.path(), FileKind::frames);
    ASSERT_TRUE(rows.ok());
    std::vector<std::string> names;
    for (const FileRow& row : *rows) names.push_back(row.name);
    EXPECT_EQ(names, (std::vector<std::string>{"a/", "b/", "shot.####.exr", "still_2.exr"}));
    EXPECT_EQ((*rows)[2].frames, 3);
    EXPECT_EQ(list_folder(folder_.path(), FileKind::chain)->back().name, "chain.yaml");
    EXPECT_FALSE(list_folder(folder_.path("none"), FileKind::chain).ok());
}

TEST_F(FilesTest, ADroppedFrameOpensItsSequence) {
    const auto request = [&](std::vector<std::string> names) {
        for (std::string& name : names) name = folder_.path(name);
        return request_for(names);
    };
    EXPECT_EQ(request({"shot.0002.exr"})->input, folder_.path("shot.####.exr"));
    EXPECT_EQ(request({"still_2.exr"})->input, folder_.path("still_2.exr"));
    const auto both = request({"chain.yaml", "camera.json"});
    ASSERT_TRUE(both.ok());
    EXPECT_EQ(both->chain, folder_.path("chain.yaml"));
    EXPECT_EQ(both->camera, folder_.path("camera.json"));
    EXPECT_EQ(both->input, "");
    EXPECT_EQ(request({""})->input, folder_.path("shot.####.exr")) << "a folder";
    EXPECT_EQ(request({"notes.txt"}).status().code(), StatusCode::usage);
    EXPECT_EQ(request({"a"}).status().code(), StatusCode::usage) << "no images";
}

bool wait_for(const std::function<bool()>& holds) {
    for (int i = 0; i < 30000 && !holds(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return holds();
}

// Frames on both sides of the one that is shown, in memory that holds three of six.
TEST(FrameStores, KeepWhatIsNearAndFits) {
    const test::TempFolder folder;
    test::write_sequence(folder.path(), {1, 2, 3, 4, 5, 6}, 8, 6);
    sequence::RunSettings settings;
    settings.input = *io::InputSpec::parse(folder.path("in.####.exr"));
    const auto chain = std::make_shared<const Chain>(
        parse_chain("postchain: 1\npasses: [fxaa]\n", "", builtin_passes()).chain.clone());
    uint64_t each = 0;
    {
        FrameStore store(settings, 1, [] {});
        store.want(2, 1, chain);
        ASSERT_TRUE(wait_for([&] { return store.find(2) != nullptr; }));
        each = store.bytes();
        EXPECT_GE(each, 8u * 6 * 4 * sizeof(float));
        EXPECT_NE(store.version(2), 0u);
        EXPECT_EQ(store.version(3), 0u);
        EXPECT_EQ(store.failure(7).code(), StatusCode::input);
        EXPECT_TRUE(store.failure(3).ok()) << "not read yet";
    }
    FrameStore store(settings, 3 * each, [] {});
    const auto kept = [&] {
        std::set<int> frames;
        for (const int frame : store.frames())
            if (store.find(frame)) frames.insert(frame);
        return frames;
    };
    const auto expect_kept = [&](int wanted, int direction, const std::set<int>& frames) {
        store.want(wanted, direction, chain);
        EXPECT_TRUE(wait_for([&] { return kept() == frames; }))
            << wanted << ": " << testing::PrintToString(kept());
        EXPECT_LE(store.bytes(), 3 * each);
    };
    expect_kept(1, 1, {1, 2, 3});
    expect_kept(3, 1, {3, 4, 5});
    expect_kept(5, 1, {5, 6, 1});  // from the end to the beginning
    expect_kept(2, -1, {2, 1, 6});
    expect_kept(4, -1, {4, 3, 2});
}

// Results of 4 x 2 pixels in memory that holds three.
TEST(ResultStores, KeepWhatWasUsedLast) {
    constexpr uint64_t kEach = 4 * 2 * 4 * sizeof(float);
    ResultStore store(3 * kEach);
    const auto keep = [&](const ResultKey& key, int width = 4) {
        Shown shown;
        shown.color = std::make_shared<const ImageF>(width, 2, 4);
        shown.texture = shown.color;
        shown.texture_name = "fill";
        shown.frame = key.frame;
        shown.draft = false;
        store.keep(key, shown);
    };
    using Keys = std::vector<ResultKey>;
    const ResultKey one{1, 7, 11, 13}, two{2, 7, 11, 13}, three{3, 7, 11, 13}, four{4, 7, 11, 13};
    for (const ResultKey& key : {two, one, one, three}) keep(key);
    EXPECT_EQ(store.keys(), (Keys{one, two, three}));
    EXPECT_EQ(store.bytes(), 3 * kEach);
    ASSERT_TRUE(store.find(two));
    EXPECT_EQ(store.find(two)->frame, 2);
    EXPECT_FALSE(store.find(two)->draft);
    EXPECT_FALSE(store.find(two)->texture);
    EXPECT_EQ(store.find(two)->texture_name, "");
    for (const ResultKey& other :
         {ResultKey{5, 7, 11, 13}, {1, 8, 11, 13}, {1, 7, 12, 13}, {1, 7, 11, 14}})
        EXPECT_FALSE(store.find(other));
    EXPECT_TRUE(store.find(one));
    keep(four);  // in place of `three`, which was used longest ago
    EXPECT_EQ(store.keys(), (Keys{one, two, four}));
    keep({6, 7, 11, 13}, 13);  // larger than all memory
    EXPECT_EQ(store.keys(), (Keys{one, two, four}));
    // Another chain's result of a frame is kept beside it, those of former files and shaders not.
    const ResultKey chain{4, 7, 12, 13}, file{4, 8, 12, 13}, shaders{1, 7, 11, 14};
    keep(chain);
    EXPECT_EQ(store.keys(), (Keys{one, four, chain}));
    keep(file);
    EXPECT_EQ(store.keys(), (Keys{one, file}));
    keep(shaders);
    EXPECT_EQ(store.keys(), (Keys{shaders, file}));
    EXPECT_EQ(store.bytes(), 2 * kEach);
}

class PlaybackTest : public testing::Test {
  protected:
    PlaybackTest() {
        for (const char* frame : {"3", "4", "6", "9"})
            test::write_text(folder_.path(std::string("in.000") + frame + ".exr"), "");
        settings_.input = *io::InputSpec::parse(folder_.path("in.####.exr"));
    }
    test::TempFolder folder_;
    sequence::RunSettings settings_;
};
using Frames = std::vector<int>;

TEST_F(PlaybackTest, StepsAndRanges) {
    const FrameStore store(settings_, 1, [] {});
    EXPECT_EQ(Playback(store, 6).frame(), 6);
    Playback playback(store, {});
    EXPECT_EQ(playback.frame(), 3);
    EXPECT_EQ(playback.direction(), 1);
    EXPECT_EQ(playback.missing_frames(), (Frames{5, 7, 8}));
    for (const auto& [to, frame, direction] :
         {std::tuple(8, 9, 1), {9, 9, 1}, {-5, 3, -1}, {2, 3, -1}, {7, 6, 1}, {5, 4, -1}}) {
        playback.go_to(to);
        EXPECT_EQ(playback.frame(), frame) << to;
        EXPECT_EQ(playback.direction(), direction) << to;
    }
    for (const auto& [by, frame, direction] :
         {std::tuple(1, 6, 1), {2, 3, 1}, {-1, 9, -1}, {-2, 4, -1}, {-7, 6, -1}, {9, 9, 1}}) {
        playback.step(by);
        EXPECT_EQ(playback.frame(), frame) << by;
        EXPECT_EQ(playback.direction(), direction) << by;
    }
    EXPECT_EQ(playback.frames_in_range(), (Frames{3, 4, 6, 9}));
    playback.set_range({{6, 4}});
    EXPECT_EQ(playback.range(), (std::array<int, 2>{4, 6}));
    EXPECT_EQ(playback.frames_in_range(), (Frames{4, 6}));
    playback.set_range({});
    EXPECT_EQ(playback.frames_in_range(), (Frames{3, 4, 6, 9}));
    playback.set_fps(0);
    EXPECT_EQ(playback.fps(), 1);
}

TEST_F(PlaybackTest, PlaysAtItsRate) {
    const FrameStore store(settings_, 1, [] {});
    Playback playback(store, 6);
    EXPECT_EQ(playback.fps(), 24);
    playback.set_fps(2);
    playback.play_on(Clock::now() + std::chrono::seconds(9));
    EXPECT_EQ(playback.frame(), 6) << "stopped";
    const auto plays = [&](int direction) {
        playback.play(direction);
        Frames frames;
        auto now = Clock::now();
        for (int i = 0; i < 4; ++i) {
            playback.play_on(now += std::chrono::milliseconds(250));  // too early
            frames.push_back(playback.frame());
            playback.play_on(now += std::chrono::milliseconds(500));
            EXPECT_EQ(playback.direction(), direction);
        }
        return frames;
    };
    EXPECT_EQ(plays(1), (Frames{6, 9, 3, 4}));
    EXPECT_EQ(playback.frame(), 6);
    EXPECT_EQ(plays(-1), (Frames{6, 4, 3, 9}));
    EXPECT_EQ(playback.frames_played(), 8);
    playback.set_range({{4, 6}});
    playback.go_to(9);
    EXPECT_EQ(plays(1), (Frames{9, 4, 6, 4}));
    playback.go_to(3);
    EXPECT_EQ(plays(-1), (Frames{3, 6, 4, 6}));
}

TEST_F(PlaybackTest, FillsTheRangeAndComesBack) {
    const FrameStore store(settings_, 1, [] {});
    Playback playback(store, 9);
    // From each frame, also the second time.
    for (const int from : {9, 3}) {
        playback.go_to(from);
        playback.set_range({{4, 8}});
        playback.play(-1);
        playback.fill_results(true);
        EXPECT_TRUE(playback.filling());
        EXPECT_EQ(playback.playing(), 0);
        EXPECT_EQ(playback.frame(), 4);
        EXPECT_TRUE(playback.fill_on({4}, true));
        EXPECT_EQ(playback.frame(), 6);
        EXPECT_TRUE(playback.filling());
        EXPECT_TRUE(playback.fill_on({4, 6}, false)) << "no room is needed any more";
        EXPECT_FALSE(playback.filling());
        EXPECT_EQ(playback.frame(), from);
    }
    playback.set_range({});
    playback.fill_results(true);
    EXPECT_TRUE(playback.fill_on({3, 4}, true));
    EXPECT_EQ(playback.frame(), 6) << "4 is kept";
    EXPECT_EQ(playback.direction(), 1);
    EXPECT_FALSE(playback.fill_on({3, 4, 6}, false)) << "no room";
    EXPECT_FALSE(playback.filling());
    EXPECT_EQ(playback.frame(), 3);
    playback.fill_results(true);
    playback.play(1);
    EXPECT_FALSE(playback.filling()) << "play ends it";
    playback.set_range({{7, 8}});
    playback.fill_results(true);
    EXPECT_FALSE(playback.filling()) << "no frame in the range";
}

}  // namespace
}  // namespace postchain::view
