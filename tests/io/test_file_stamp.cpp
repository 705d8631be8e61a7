#include "tools/sequence/files/file_stamp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "tests/io/exr_files.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(FileStamp, NoticesSizeTimeAndAbsence) {
    const test::TempFolder folder;
    const std::string path = folder.path("a.exr");
    std::ofstream(path) << "four";
    const FileStamp stamp = FileStamp::of(path);
    EXPECT_EQ(stamp.bytes, 4u);
    EXPECT_TRUE(stamp.unchanged().ok());
    const auto time = fs::last_write_time(path);
    fs::last_write_time(path, time + std::chrono::milliseconds(10));
    EXPECT_EQ(stamp.unchanged().code(), StatusCode::input);
    EXPECT_THAT(stamp.unchanged().message(), HasSubstr("a.exr: was changed"));
    std::ofstream(path) << "five5";
    fs::last_write_time(path, time);
    EXPECT_THAT(stamp.unchanged().message(), HasSubstr("4 bytes before, 5 now"));
    std::ofstream(path) << "FOUR";
    fs::last_write_time(path, time);
    EXPECT_TRUE(stamp.unchanged().ok());
    fs::remove(path);
    EXPECT_THAT(stamp.unchanged().message(), HasSubstr("was removed"));
}

}  // namespace
}  // namespace postchain::io
