// Only a file with all of its bytes is complete: each kind of EXR, written by OpenEXR, truncated at
// every length, and with each entry of its table of chunks not yet written. A file's stamp tells
// whether it has changed since.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <filesystem>

#include "tests/io/exr_files.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/planes/complete_file.h"

namespace postchain::io {
namespace {

using test::bytes_of_file;
using test::FilePart;
using test::MemoryFile;
using test::read_whole;
using test::rgba_z;
using testing::HasSubstr;

std::vector<std::vector<FilePart>> kinds() {
    FilePart lines = rgba_z(), upwards = lines, mip = lines, tiles = rgba_z("t"),
             deep = rgba_z("d");
    lines.compression = Imf::NO_COMPRESSION;
    upwards.compression = Imf::ZIPS_COMPRESSION;
    upwards.line_order = Imf::DECREASING_Y;
    mip.tile = 4;
    mip.levels = Imf::MIPMAP_LEVELS;
    tiles.tile = 5;
    for (auto& channel : deep.channels) channel.type = Imf::FLOAT;
    deep.deep = true;
    deep.compression = Imf::ZIPS_COMPRESSION;
    FilePart deep_tiles = deep;
    deep_tiles.name = "e";
    deep_tiles.tile = 4;
    return {{lines}, {rgba_z()},        {upwards}, {mip}, {rgba_z("a"), tiles},
            {deep},  {deep, deep_tiles}};
}

TEST(CompleteFile, IsTheWholeFileAlone) {
    MemoryFile file;
    for (const auto& parts : kinds()) {
        const std::string bytes = bytes_of_file(parts);
        for (size_t length = 0; length <= bytes.size(); ++length) {
            file.set(std::string_view(bytes).substr(0, length));
            const Status status = check_complete(file.path());
            ASSERT_EQ(status.ok(), length == bytes.size()) << length << status.message();
            if (status.ok()) continue;
            EXPECT_EQ(status.code(), StatusCode::input);
            EXPECT_THAT(status.message(), HasSubstr(file.path()));
            // The reader refuses it too, unless only a smaller level is cut: the writer, which
            // would copy that, checks it.
            const Status read = read_whole(file.path());
            if (parts[0].levels == Imf::MIPMAP_LEVELS && read.ok()) continue;
            ASSERT_EQ(read.code(), StatusCode::input) << length << " of " << bytes.size();
            EXPECT_THAT(read.message(), HasSubstr(file.path()));
        }
    }
}

TEST(CompleteFile, EachChunkHasItsPlaceInTheTable) {
    FilePart lines = rgba_z();
    lines.compression = Imf::ZIPS_COMPRESSION;  // a chunk for each of nine lines
    const std::string whole = bytes_of_file({lines});
    const size_t table = test::chunk_table_of(whole, 9);
    MemoryFile file;
    for (size_t chunk = 0; chunk < 9; ++chunk) {
        std::string bytes = whole;
        std::memset(bytes.data() + table + 8 * chunk, 0, 8);
        file.set(bytes);
        EXPECT_THAT(check_complete(file.path()).message(),
                    HasSubstr("1 of 9 chunks are not written"));
        // Behind the end, and so near to the end that the chunk does not fit.
        for (const uint64_t offset : {whole.size(), whole.size() - 1, whole.size() - 9}) {
            bytes = whole;
            std::memcpy(bytes.data() + table + 8 * chunk, &offset, 8);
            file.set(bytes);
            EXPECT_FALSE(check_complete(file.path()).ok()) << chunk << " at " << offset;
        }
    }
}

TEST(CompleteFile, ATableOfALaterPartCountsToo) {
    FilePart second = rgba_z("b");
    second.compression = Imf::ZIPS_COMPRESSION;
    std::string bytes = bytes_of_file({rgba_z("a"), second});
    // Ten chunks in two consecutive tables: one, then nine.
    std::memset(bytes.data() + test::chunk_table_of(bytes, 10) + 8 * 5, 0, 8);
    MemoryFile file;
    file.set(bytes);
    EXPECT_THAT(check_complete(file.path()).message(),
                HasSubstr("1 of 9 chunks of part 1 are not written"));
}

TEST(CompleteFile, OfAPartOfAnUnknownTypeOnlyTheTableIsKnown) {
    std::string bytes = bytes_of_file({rgba_z("a"), rgba_z("b")});
    const size_t type = bytes.find("scanlineimage");
    ASSERT_NE(type, std::string::npos);
    bytes[type] = 'S';
    MemoryFile file;
    file.set(bytes);
    EXPECT_TRUE(check_complete(file.path()).ok()) << check_complete(file.path()).message();
    std::memset(bytes.data() + test::chunk_table_of(bytes, 2), 0, 8);
    file.set(bytes);
    EXPECT_THAT(check_complete(file.path()).message(), HasSubstr("1 of 1 chunks of part 0"));
}

TEST(FileStamp, NoticesSizeTimeAndAbsence) {
    const test::TempFolder folder;
    const std::string path = folder.path("a.exr");
    test::write_text(path, "four");
    const FileStamp stamp = FileStamp::of(path);
    EXPECT_EQ(stamp.bytes, 4u);
    EXPECT_TRUE(stamp.unchanged().ok());
    namespace fs = std::filesystem;
    const auto time = fs::last_write_time(path);
    fs::last_write_time(path, time + std::chrono::milliseconds(10));
    EXPECT_EQ(stamp.unchanged().code(), StatusCode::input);
    EXPECT_THAT(stamp.unchanged().message(), HasSubstr("a.exr: was changed"));
    test::write_text(path, "five5");
    fs::last_write_time(path, time);
    EXPECT_THAT(stamp.unchanged().message(), HasSubstr("4 bytes before, 5 now"));
    test::write_text(path, "FOUR");
    fs::last_write_time(path, time);
    EXPECT_TRUE(stamp.unchanged().ok());
    fs::remove(path);
    EXPECT_THAT(stamp.unchanged().message(), HasSubstr("was removed"));
}

}  // namespace
}  // namespace postchain::io
