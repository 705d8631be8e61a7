// Headers that state more than their file can hold. The header scan refuses each, with a remedy in
// the message, before anything large has been allocated.
#include <ImfStringAttribute.h>
#include <ImfStringVectorAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/exr_files.h"
#include "tests/io/largest_allocation.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_header_scan.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/planes/frame_writer.h"

namespace postchain::io::test_hostile_header {
namespace {

using test::bytes_of_file;
using test::FilePart;
using test::must;
using test::rgba_z;
using test::TempFolder;
using testing::AllOf;
using testing::HasSubstr;

constexpr size_t kSmall = size_t(4) << 20;  // OpenEXR and this reader need a few buffers

// Opens and reads everything; returns the error message. Allocates at most `most` bytes at once.
std::string error_of(const std::string& bytes, const ReadLimits& limits = {},
                     size_t most = kSmall) {
    test::MemoryFile memory;
    memory.set(bytes);
    test::forget_allocations();
    const Status status = test::read_whole(memory.path(), limits);
    EXPECT_LE(test::largest_allocation(), most) << status.message();
    EXPECT_TRUE(status.ok() || status.code() == StatusCode::input) << status.message();
    return status.message();
}

template <class T>
std::string numbers(std::initializer_list<T> values) {
    return {reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(T)};
}
std::string ints(std::initializer_list<int32_t> values) {
    return numbers(values);
}
std::string longs(std::initializer_list<uint64_t> values) {
    return numbers(values);
}

// Offset of the value of the first attribute of this name and type; its size precedes it.
size_t value_at(const std::string& bytes, const std::string& name, const std::string& type) {
    const std::string key = name + '\0' + type + '\0';
    const size_t at = bytes.find(key);
    EXPECT_NE(at, std::string::npos) << name;
    return at + key.size() + 4;
}

std::string with_value(std::string bytes, const std::string& name, const std::string& type,
                       const std::string& value) {
    return bytes.replace(value_at(bytes, name, type), value.size(), value);
}

std::string with_stated_size(std::string bytes, const std::string& name, const std::string& type,
                             int32_t size) {
    return bytes.replace(value_at(bytes, name, type) - 4, 4, ints({size}));
}

// Inserts an attribute before the first one; offsets of chunks stay unchanged.
std::string with_attribute(std::string bytes, const std::string& name, const std::string& type,
                           const std::string& value) {
    return bytes.insert(8, name + '\0' + type + '\0' + ints({int32_t(value.size())}) + value);
}

TEST(HostileHeader, ValuesAndSizesOfAttributes) {
    const std::string whole = bytes_of_file({rgba_z()});
    const auto with_window = [&](int32_t x, int32_t y, int32_t last_x, int32_t last_y) {
        return error_of(with_value(whole, "dataWindow", "box2i", ints({x, y, last_x, last_y})));
    };
    constexpr int32_t kMost = 2147483647;
    for (const auto& message : {with_window(-kMost, 0, kMost, 1), with_window(0, -kMost, 1, kMost),
                                with_window(5, 5, 4, 4), with_window(0, 0, kMost, kMost)})
        EXPECT_NE(message, "");
    for (const char order : {1, 2, 3, 127, -1})  // read or refused, and nothing large allocated
        error_of(with_value(whole, "lineOrder", "lineOrder", {order}));
    for (const char compression : {10, 127, -1})
        EXPECT_THAT(error_of(with_value(whole, "compression", "compression", {compression})),
                    HasSubstr("unknown compression"));
    // OpenEXR reads these by type and not by size. A channel is "R", 0 and 16 bytes; the list ends
    // with a zero byte.
    const int32_t size = 5 * 18 + 1;
    EXPECT_EQ(error_of(with_stated_size(whole, "channels", "chlist", size)), "");
    for (const int32_t wrong : {size - 18, size - 1, size + 1, size + 18})
        EXPECT_THAT(error_of(with_stated_size(whole, "channels", "chlist", wrong)),
                    HasSubstr("channels has a wrong size"))
            << wrong;
    for (const int32_t wrong : {15, 17})
        EXPECT_THAT(error_of(with_stated_size(whole, "dataWindow", "box2i", wrong)),
                    HasSubstr("attribute dataWindow of wrong size"));
    for (const int32_t wrong : {-1, kMost, 1000000})
        EXPECT_NE(error_of(with_stated_size(whole, "dataWindow", "box2i", wrong)), "");
    // Under any name. The first list ends at its stated size, the second one byte later.
    const std::string list = std::string("X\0", 2) + ints({1, 0, 1, 1}) + '\0';
    EXPECT_THAT(error_of(with_attribute(whole, "others", "chlist", list)),
                testing::Not(HasSubstr("wrong size")));
    EXPECT_THAT(error_of(with_attribute(whole, "others", "chlist", list + '\0')),
                HasSubstr("channels has a wrong size"));
    // Width and height of a preview, then fewer pixels than that.
    const auto with_preview = [&](int32_t width, int32_t height) {
        return error_of(with_attribute(whole, "small", "preview", ints({width, height, 0, 0})));
    };
    EXPECT_THAT(with_preview(2, 1), testing::Not(HasSubstr("preview")));
    for (const auto& [width, height] :
         {std::pair(30000, 30000), {-1, -1}, {0x10000, 0x10000}, {1, 1}})
        EXPECT_THAT(with_preview(width, height), HasSubstr("a preview of wrong size"));
}

TEST(HostileHeader, TilesAndBlocksOfLinesLargerThanTheirLimits) {
    FilePart part = rgba_z();
    part.tile = 8;
    const std::string tiles = bytes_of_file({part});
    const auto with_tile = [&](int32_t width, int32_t height) {
        return with_value(tiles, "tiles", "tiledesc", ints({width, height}));
    };
    // 12 bytes a pixel: 4096 x 4096 are 192 MiB, 8192 x 8192 are 768.
    EXPECT_THAT(error_of(with_tile(8192, 8192)),
                AllOf(HasSubstr("8192x8192"), HasSubstr("768 MiB"), HasSubstr("512 MiB"),
                      HasSubstr("smaller tiles")));
    EXPECT_THAT(error_of(with_tile(16385, 1)),
                AllOf(HasSubstr("16384"), HasSubstr("smaller tiles")));
    EXPECT_THAT(error_of(with_tile(-1, -1)), HasSubstr("smaller tiles"));
    EXPECT_THAT(error_of(with_tile(0, 0)), HasSubstr("tiles of size 0"));
    for (const char levels : {0x03, 0x0f, 0x20, 0x71})
        EXPECT_THAT(
            error_of(with_value(tiles, "tiles", "tiledesc", ints({8, 8}) + std::string(1, levels))),
            HasSubstr("unknown kind of levels"));
    EXPECT_THAT(error_of(with_tile(512, 512), {.max_chunk_bytes = 3u << 20}), HasSubstr("damaged"));
    EXPECT_THAT(error_of(with_tile(513, 512), {.max_chunk_bytes = 3u << 20}),
                HasSubstr("smaller tiles"));
    // 2^16 tiles in a file of 1 KB that could hold as many pixels.
    EXPECT_THAT(
        error_of(with_value(with_tile(1, 1), "dataWindow", "box2i", ints({0, 0, 255, 255}))),
        HasSubstr("truncated: the file ends inside its header"));

    // In a single-part file OpenEXR follows the flag and not the type attribute.
    part.edit = [](Imf::Header& header) { header.insert("type", Imf::StringAttribute("x")); };
    EXPECT_THAT(error_of(with_value(with_tile(8192, 8192), "type", "string", "scanline")),
                HasSubstr("smaller tiles"));

    // A block of dwab has 256 lines even in an image of 9 lines.
    part = rgba_z();
    part.compression = Imf::DWAB_COMPRESSION;
    const std::string lines = bytes_of_file({part});
    constexpr uint64_t kBlock = 256 * 13 * 12;
    EXPECT_EQ(error_of(lines, {.max_chunk_bytes = kBlock}), "");
    EXPECT_THAT(error_of(lines, {.max_chunk_bytes = kBlock - 1}),
                AllOf(HasSubstr("256 lines of dwab"), HasSubstr("fewer channels or as zip")));
}

TEST(HostileHeader, MorePixelsThanTheFileCanHold) {
    const std::string whole = bytes_of_file({rgba_z()});
    const auto with_window = [&](int32_t width, int32_t height) {
        return with_value(whole, "dataWindow", "box2i", ints({0, 0, width - 1, height - 1}));
    };
    EXPECT_THAT(
        error_of(with_window(16384, 16384)),
        AllOf(HasSubstr("3221225472 bytes of pixels"), HasSubstr(std::to_string(whole.size())),
              HasSubstr("1032"), HasSubstr("copy or render it again")));
    // Without the rule: 16384 x 16 pixels are one block of zip, and the file has one.
    EXPECT_THAT(error_of(with_window(16384, 16)), HasSubstr("in a file of"));
    // The stated sizes of all parts are added.
    constexpr int32_t kWide = 12000;
    const std::string two = bytes_of_file({rgba_z("a"), rgba_z("b")});
    const std::string window = ints({0, 0, kWide - 1, 15});
    std::string first = with_value(two, "dataWindow", "box2i", window);
    ASSERT_LT(kWide * 16 * 12, 1032 * int(two.size()));
    ASSERT_GT(2 * kWide * 16 * 12, 1032 * int(two.size()));
    EXPECT_THAT(error_of(first), testing::Not(HasSubstr("in a file of")));
    const size_t second = value_at(first, "dataWindow", "box2i");
    const size_t at = first.find(std::string("dataWindow\0box2i", 16), second) + 21;
    EXPECT_THAT(error_of(first.replace(at, window.size(), window)),
                AllOf(HasSubstr("part 1"), HasSubstr("in a file of")));
}

// Black frames are real: the densest files that OpenEXR writes must not be refused. The fewer
// chunks, the denser: one tile or few long blocks, large enough that the rest is negligible.
TEST(HostileHeader, BlackFramesOfEveryCompressionAreRead) {
    const TempFolder folder;
    const std::string path = folder.path("black.exr");
    for (int number = 0; number < Imf::NUM_COMPRESSION_METHODS; ++number) {
        const bool dwa = number >= Imf::DWAA_COMPRESSION;  // packs a channel by its name
        const int side = dwa ? 2048 : 1024;
        FilePart part{.data = {{0, 0}, {side - 1, side - 1}},
                      .compression = Imf::Compression(number),
                      .black = true};
        part.display = part.data;
        for (const char* name : {"A", "R"})
            for (const auto type : {Imf::HALF, Imf::FLOAT})
                for (const int tile : {0, side}) {
                    if (*name == 'R' && !dwa) continue;
                    part.channels = {{name, type}};
                    part.tile = tile;
                    test::write_file(path, {part});
                    const auto file = must(ExrFile::open(path));
                    EXPECT_LE(uint64_t(side) * side * (type == Imf::HALF ? 2 : 4),
                              most_packed(number) * file.file_bytes());
                }
    }
}

TEST(HostileHeader, LimitsOnChannelsAndBytes) {
    FilePart part{.data = {{0, 0}, {0, 0}}};
    for (int i = 0; i < 4097; ++i) part.channels.push_back({concat("layer.", i)});
    EXPECT_THAT(error_of(bytes_of_file({part})),
                AllOf(HasSubstr("more than 4096 channels"), HasSubstr("write fewer")));
    part.channels.pop_back();
    EXPECT_EQ(error_of(bytes_of_file({part})), "");
    EXPECT_THAT(error_of(bytes_of_file({rgba_z()}), {.max_channels = 4}),
                HasSubstr("more than 4 channels"));
    part = rgba_z();
    part.data = {{0, 0}, {511, 511}};  // 12 bytes a pixel: 3 MiB
    const std::string whole = bytes_of_file({part});
    EXPECT_EQ(error_of(whole, {.max_bytes = 3u << 20}, size_t(16) << 20), "");
    EXPECT_THAT(error_of(whole, {.max_bytes = (3u << 20) - 1}),
                AllOf(HasSubstr("3 MiB"), HasSubstr("fewer channels")));
}

TEST(HostileHeader, LongTexts) {
    FilePart part = rgba_z();
    part.edit = [](Imf::Header& header) {
        header.insert("notes", Imf::StringAttribute(std::string(300000, 'n')));
        header.insert("list", Imf::StringVectorAttribute({std::string(1000, 'a'), "b"}));
    };
    const std::string whole = bytes_of_file({part});
    EXPECT_EQ(error_of(whole), "");
    EXPECT_THAT(error_of(whole, {.max_header_bytes = 300000}),
                AllOf(HasSubstr("header is larger than 292 KiB"), HasSubstr("attribute notes")));
    // A stated length above the file's size, for a string and in a list of strings.
    for (const int32_t length : {1 << 20, 1 << 25})
        EXPECT_THAT(error_of(with_stated_size(whole, "notes", "string", length)),
                    HasSubstr("truncated"));
    EXPECT_THAT(error_of(with_stated_size(whole, "notes", "string", 0x7fffffff)),
                HasSubstr("header is larger than 65536 KiB"));
    for (const int32_t length : {-1, 1009, 0x7fffffff})
        EXPECT_FALSE(error_of(with_value(whole, "list", "stringvector", ints({length}))).empty());
    std::string name = whole;
    EXPECT_FALSE(error_of(name.insert(8, std::string(300000, 'n'))).empty());
}

TEST(HostileHeader, CountsAndOrdersOfChunks) {
    const std::string parts = bytes_of_file({rgba_z("a"), rgba_z("b")});
    for (const int32_t count : {-1, 0x7fffffff, 1 << 20, 0, 2})
        EXPECT_THAT(error_of(with_value(parts, "chunkCount", "int", ints({count}))),
                    HasSubstr("a wrong number of chunks"))
            << count;
    // For an unknown type only the count of chunks is known.
    const std::string unknown = with_value(parts, "type", "string", "scanlineimagf");
    for (const int32_t count : {-1, 0x7fffffff, 1 << 20})
        EXPECT_THAT(error_of(with_value(unknown, "chunkCount", "int", ints({count}))),
                    testing::AnyOf(HasSubstr("a wrong number of chunks"), HasSubstr("truncated")))
            << count;
    // Entries of all levels are checked: the last one is behind the end.
    FilePart levels = rgba_z();
    levels.tile = 4;
    for (const auto& [mode, rounding, chunks] :
         {std::tuple(Imf::MIPMAP_LEVELS, Imf::ROUND_DOWN, 12 + 2 + 1 + 1),
          {Imf::MIPMAP_LEVELS, Imf::ROUND_UP, 12 + 4 + 1 + 1 + 1},
          {Imf::RIPMAP_LEVELS, Imf::ROUND_DOWN, (4 + 2 + 1 + 1) * (3 + 1 + 1 + 1)},
          {Imf::RIPMAP_LEVELS, Imf::ROUND_UP, (4 + 2 + 1 + 1 + 1) * (3 + 2 + 1 + 1 + 1)}}) {
        levels.levels = mode;
        levels.edit = [mode = mode, rounding = rounding](Imf::Header& header) {
            header.setTileDescription(Imf::TileDescription(4, 4, mode, rounding));
        };
        std::string bytes = bytes_of_file({levels});
        ASSERT_EQ(error_of(bytes), "");
        const size_t end = test::chunk_table_of(bytes, size_t(chunks)) + 8 * size_t(chunks);
        EXPECT_THAT(error_of(bytes.replace(end - 8, 8, longs({1 << 20}))),
                    HasSubstr("pixels are missing"));
    }
}

TEST(HostileHeader, MorePartsThanAnyFileHas) {
    std::string bytes = bytes_of_file({rgba_z("a"), rgba_z("b")});
    const std::string first = std::string("channels\0chlist", 15);
    const std::string part = bytes.substr(8, bytes.find(first, 8 + first.size()) - 8);
    std::string parts;
    for (int i = 0; i < 4095; ++i) parts += part;
    EXPECT_THAT(error_of(bytes.insert(8, parts)), HasSubstr("too many parts"));
}

// Deep parts are copied chunk by chunk, into buffers of the stated size of a chunk.
TEST(HostileHeader, DeepChunksLargerThanTheFile) {
    for (const int tile : {0, 4}) {
        for (const bool several : {false, true}) {
            FilePart deep{.name = several ? "deep" : "",
                          .channels = {{"Z", Imf::FLOAT}},
                          .compression = Imf::ZIPS_COMPRESSION,
                          .tile = tile,
                          .deep = true};
            const std::string whole =
                bytes_of_file(several ? std::vector{deep, rgba_z("flat")} : std::vector{deep});
            EXPECT_EQ(error_of(whole), "");
            // The first chunk follows the tables: 9 lines, or 4 x 3 tiles; then 1 block.
            const size_t chunks = size_t((tile == 0 ? 9 : 12) + (several ? 1 : 0));
            const size_t chunk = test::chunk_table_of(whole, chunks) + 8 * chunks;
            const size_t sizes = chunk + (several ? 4 : 0) + (tile == 0 ? 4 : 16);
            for (const auto& wrong :
                 {longs({uint64_t(1) << 34, 8}), longs({8, uint64_t(1) << 34}),
                  longs({~uint64_t(0), 1}), longs({1, ~uint64_t(0)}), longs({8, whole.size()})}) {
                std::string bytes = whole;
                EXPECT_THAT(error_of(bytes.replace(sizes, 16, wrong)),
                            AllOf(HasSubstr("a deep chunk is larger than the file"),
                                  HasSubstr("copy or render it again")));
            }
        }
    }
}

// Tiles are copied as stored; OpenEXR reads their size as a signed number.
TEST(HostileHeader, CopiedTilesOfNegativeSize) {
    const TempFolder folder;
    FilePart tiles{.name = "tiles", .channels = {{"Z", Imf::FLOAT}}, .tile = 8};
    const std::string whole = bytes_of_file({rgba_z("color"), tiles});
    // Part 1, tile (1, 0) of level 0, then its size.
    const size_t chunk = whole.find(ints({1, 1, 0, 0, 0}));
    ASSERT_NE(chunk, std::string::npos);
    const auto copy = [&](int32_t size) {
        std::string bytes = whole;
        test::MemoryFile memory;
        memory.set(size == 0 ? bytes : bytes.replace(chunk + 20, 4, ints({size})));
        const ReadFile frame = read_ok(memory.path());
        const ImageF color = frame.planes.at(Role::color);
        return write_filtered(folder.path("copy.exr"), frame, color,
                              {.on_existing = OnExisting::overwrite})
            .status();
    };
    EXPECT_EQ(copy(0).message(), "");
    for (const int32_t size : {-1, -108, -2147483647 - 1})
        EXPECT_THAT(copy(size).message(), HasSubstr("negative size")) << size;
    for (const int32_t size : {2147483647, 1 << 20}) EXPECT_FALSE(copy(size).ok()) << size;
}

}  // namespace
}  // namespace postchain::io::test_hostile_header
