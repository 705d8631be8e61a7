// Chunks that tools/sequence/exr packs and unpacks itself, against OpenEXR and OpenImageIO. Every
// kind of damaged chunk must be refused with its message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/exr/zip.h"

namespace postchain::io::test_exr_chunks {
namespace {

using test::FilePart;
using test::must;
using test::oiio_channels;
using test::TempFolder;
using test::write_file;
using testing::AllOf;
using testing::HasSubstr;

// One pixel, one line, one column, one line more than a block of ZIP, one less, several blocks.
const std::vector<Imath::Box2i> kWindows = {{{0, 0}, {0, 0}},    {{-3, 5}, {60, 5}},
                                            {{4, -9}, {4, 30}},  {{1, -1}, {37, 15}},
                                            {{-7, 3}, {20, 17}}, {{-20, -33}, {11, 40}}};

// Every compression, tile and window; the order of lines and whether the pixels become smaller
// alternate, so that each of them meets the others.
std::vector<FilePart> all_parts() {
    std::vector<FilePart> parts;
    size_t number = 0;
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION})
        for (const int tile : {0, 1, 7, 16})
            for (const Imath::Box2i& window : kWindows) {
                if (tile == 1 && window != kWindows[0] && window != kWindows[1]) continue;
                FilePart part = every_type();
                part.data = window;
                part.compression = compression;
                part.tile = tile;
                part.line_order = number % 2 ? Imf::DECREASING_Y : Imf::INCREASING_Y;
                part.repeating = number % 3 > 0;
                parts.push_back(part);
                ++number;
            }
    return parts;
}

std::string text_of(const FilePart& part) {
    return concat("compression ", int(part.compression), ", tile ", part.tile, ", order ",
                  int(part.line_order), ", window ", part.data.min.x, " ", part.data.min.y, " ",
                  part.data.max.x, " ", part.data.max.y, part.repeating ? ", repeating" : "");
}

// With the input's own color the file is the one that OpenEXR writes: header, table and chunks are
// equal byte by byte if nothing is deflated, or if zlib deflates as in OpenEXR. With another color
// only that changes.
TEST_F(ExrChunks, AreThoseThatOpenExrWrites) {
    int same = 0, threads = 0;
    for (const FilePart& part : all_parts()) {
        SCOPED_TRACE(text_of(part));
        threads = 3 - threads;
        set_exr_threads(threads);
        write_file(in, {part});
        ReadFile frame = read_ok(in);
        write_ok(out, frame, frame.planes.at(Role::color),
                 {.on_existing = OnExisting::overwrite, .zip_level = 4});
        ASSERT_TRUE(oiio_channels(in) == oiio_channels(out));
        if (part.compression == Imf::NO_COMPRESSION ||
            deflate_library() == std::string_view("zlib")) {
            ASSERT_TRUE(test::read_text(in) == test::read_text(out));
            ++same;
        }
        const ImageF color = new_color(frame);
        write_ok(out, frame, color, {.on_existing = OnExisting::overwrite});
        expect_only_color_changed(in, out, 0, kRgba, color);
    }
    set_exr_threads(0);
    EXPECT_GT(same, 15);
}

// Lines read alone or a few at a time equal those of the whole part.
TEST_F(ExrChunks, RowsAreThoseOfTheWhole) {
    const std::string path = in;
    for (FilePart part : all_parts()) {
        if (part.tile == 1 || part.data != kWindows.back()) continue;
        part.data = {{-7, -20}, {10, 19}};
        SCOPED_TRACE(text_of(part));
        write_file(path, {part});
        auto file = must(ExrFile::open(path));
        const auto whole = must(file.read_part(0));
        for (const auto& [first, last] :
             {std::pair(-20, -20), {-5, -4}, {-4, 11}, {-3, 12}, {19, 19}, {18, 40}}) {
            const auto rows = must(file.read_part(0, {"G", "Z"}, Window{0, first, 0, last}));
            ASSERT_EQ(rows.planes.size(), 2u);
            EXPECT_LE(rows.window.min_y, first);
            EXPECT_GE(rows.window.max_y, std::min(last, 19));
            for (const PartPixels::Plane& plane : rows.planes) {
                const PartPixels::Plane* all = whole.find(plane.channel.name);
                const size_t skipped = size_t(rows.window.min_y + 20) * plane.row_bytes();
                EXPECT_EQ(
                    std::memcmp(plane.bytes.get(), all->bytes.get() + skipped, plane.total_bytes()),
                    0);
            }
        }
    }
}

TEST_F(ExrChunks, SubsampledChannels) {
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION}) {
        FilePart part = every_type();
        part.channels.push_back({"half_size", Imf::FLOAT, 2});
        part.channels.push_back({"wide", Imf::HALF, 4, 1});
        part.channels.push_back({"high", Imf::HALF, 1, 4});
        part.data = {{-8, -4}, {23, 39}};
        part.compression = compression;
        part.repeating = true;
        write_file(in, {part});
        ReadFile frame = read_ok(in);
        write_ok(out, frame, frame.planes.at(Role::color), {.on_existing = OnExisting::overwrite});
        // OpenImageIO converts such channels, so OpenEXR's own bytes are compared.
        if (compression == Imf::NO_COMPRESSION) {
            ASSERT_TRUE(test::read_text(in) == test::read_text(out));
        }
        expect_samples(in, 0, part);
        expect_samples(out, 0, part);
    }
}

// Every chunk but the last, which is black, is stored unpacked: the file is larger than its pixels.
TEST_F(ExrChunks, WhatDoesNotBecomeSmallerIsStored) {
    const std::string path = out;
    std::mt19937 random(3);
    ImageF noise(64, 48, 2, 0.0f);
    for (size_t i = 0; i < size_t(64) * 32 * 2; ++i) {
        uint32_t bits;
        do bits = random();
        while ((bits & 0x7f800000u) == 0x7f800000u);
        std::memcpy(&noise.data[i], &bits, 4);
    }
    noise.data[7] = std::numeric_limits<float>::infinity();
    EXPECT_EQ(must(write_planes_exr(path, noise, {"a", "b"})).nonfinite_pixels, 1u);
    const size_t stored = 64 * 32 * 2 * 4, all = 64 * 48 * 2 * 4,
                 bytes = test::read_text(path).size();
    EXPECT_GT(bytes, stored + 3 * 16);
    EXPECT_LT(bytes, stored + (all - stored) / 4);
    auto file = must(ExrFile::open(path));
    const auto again = must(file.read_channels(0, {"a", "b"}));
    EXPECT_EQ(std::memcmp(again.data.data(), noise.data.data(), all), 0);
}

// A number in a chunk, counted from the chunk's first byte, is replaced.
struct Damage {
    FilePart part;
    size_t at;
    std::vector<int32_t> wrong;
    const char* place;
    const char* why;
};

TEST(DamagedChunk, IsRefusedWithItsPlace) {
    FilePart lines{.channels = {{"R"}, {"G"}, {"Z", Imf::FLOAT}}};
    lines.data = {{0, 5}, {9, 14}};
    lines.repeating = true;
    FilePart tile = lines, named = lines;
    tile.tile = 16;
    named.name = "beauty";
    FilePart unpacked{.channels = {{"R"}}, .compression = Imf::NO_COMPRESSION};
    unpacked.data = {{0, 0}, {9, 0}};
    constexpr int32_t kLeast = std::numeric_limits<int32_t>::min(), kMost = 0x7fffffff;
    const int32_t pixels = 10 * 10 * 8;
    const Damage all[] = {{lines, 4, {-1, kLeast, pixels + 1, kMost}, "lines 5 to 14", "size"},
                          // The size of an unpacked chunk, but the file has fewer bytes.
                          {lines, 4, {pixels}, "lines 5 to 14", "truncated"},
                          {lines, 4, {0, 1, 50}, "lines 5 to 14", "unpack"},
                          {lines, 0, {6}, "lines 5 to 14", "another chunk"},
                          {tile, 0, {1}, "tile (0, 5)-(9, 14)", "another chunk"},
                          {tile, 4, {1}, "tile (0, 5)-(9, 14)", "another chunk"},
                          {tile, 8, {1}, "tile (0, 5)-(9, 14)", "another chunk"},
                          {tile, 12, {1}, "tile (0, 5)-(9, 14)", "another chunk"},
                          {named, 0, {1}, "lines 5 to 14", "another chunk"},
                          // It has no checksum, but must have exactly the size of its pixels.
                          {unpacked, 4, {0, 19, 21, -20}, "lines 0 to 0", "size"}};
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    for (const Damage& damage : all) {
        const std::string whole = test::bytes_of_file({damage.part});
        for (const int32_t wrong : damage.wrong) {
            std::string bytes = whole;
            std::memcpy(bytes.data() + test::chunk_table_of(whole, 1) + 8 + damage.at, &wrong, 4);
            test::write_text(path, bytes);
            const Status status = test::read_whole(path);
            EXPECT_EQ(status.code(), StatusCode::input) << damage.why << " " << wrong;
            EXPECT_THAT(status.message(),
                        AllOf(HasSubstr(path), HasSubstr(damage.place), HasSubstr(damage.why)))
                << wrong;
        }
    }
}

// A bit of the last chunk's checksum.
TEST(DamagedChunk, NamesItsPart) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    write_file(path, {{.name = "first", .channels = {{"R"}}},
                      {.name = "second", .channels = {{"R"}}, .repeating = true}});
    std::string bytes = test::read_text(path);
    bytes.back() = char(bytes.back() ^ 1);
    test::write_text(path, bytes);
    auto file = must(ExrFile::open(path));
    EXPECT_TRUE(file.read_part(0).ok());
    EXPECT_THAT(
        file.read_part(1).status().message(),
        AllOf(HasSubstr("part 1 'second'"), HasSubstr("lines 0 to 8"), HasSubstr("unpack")));
}

}  // namespace
}  // namespace postchain::io::test_exr_chunks
