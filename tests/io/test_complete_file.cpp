// Only a file with all of its bytes is complete: each kind of EXR, written by OpenEXR, truncated at
// every length, and with each entry of its table of chunks not yet written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/io/exr_files.h"
#include "tools/sequence/frame/complete_file.h"

namespace postchain::io {
namespace {

using test::bytes_of_file;
using test::FilePart;
using test::MemoryFile;
using test::rgba_z;
using test::TempFolder;
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
    std::string bytes = whole;
    std::memset(bytes.data() + table, 0, 72);
    file.set(bytes);
    EXPECT_THAT(check_complete(file.path()).message(), HasSubstr("9 of 9 chunks are not written"));
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

TEST(CompleteFile, NeedsAFile) {
    TempFolder folder;
    EXPECT_THAT(check_complete(folder.path("none.exr")).message(), HasSubstr("No such file"));
    EXPECT_THAT(check_complete(folder.path()).message(), HasSubstr("is not a file"));
    test::write_text(folder.path("a.exr"), "");
    EXPECT_THAT(check_complete(folder.path("a.exr")).message(), HasSubstr("zero bytes"));
}

}  // namespace
}  // namespace postchain::io
