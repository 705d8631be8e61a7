// Files that are opened: lists of folders, what a dropped file is, and frames that are kept.
#include "tools/apps/view/files.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <set>
#include <thread>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/apps/view/frame_store.h"

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

}  // namespace
}  // namespace postchain::view
