// Files that are opened: lists of folders, and what a dropped file is.
#include "tools/apps/view/files.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

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

}  // namespace
}  // namespace postchain::view
