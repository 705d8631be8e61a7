// Chunks that tools/sequence/exr packs and unpacks itself, against OpenEXR and OpenImageIO. Every
// kind of damaged chunk must be refused with its message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <random>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/exr/zlib_stream.h"

namespace postchain::io::test_exr_chunks {
namespace {

using test::FilePart;
using test::oiio_channels;
using test::TempFolder;
using test::write_file;
using testing::AllOf;
using testing::HasSubstr;

// One pixel, one line, one column, one line more than a block of ZIP, one less, several blocks.
const std::vector<Imath::Box2i> kWindows = {{{0, 0}, {0, 0}},    {{-3, 5}, {60, 5}},
                                            {{4, -9}, {4, 30}},  {{1, -1}, {37, 15}},
                                            {{-7, 3}, {20, 17}}, {{-20, -33}, {11, 40}}};

struct Layout {
    Imf::Compression compression;
    int tile;
    Imf::LineOrder order;
};

std::vector<Layout> layouts() {
    std::vector<Layout> list;
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION})
        for (const int tile : {0, 1, 7, 16})
            for (const auto order : {Imf::INCREASING_Y, Imf::DECREASING_Y})
                list.push_back({compression, tile, order});
    return list;
}

std::vector<FilePart> all_parts() {
    std::vector<FilePart> parts;
    for (const Layout& layout : layouts())
        for (const Imath::Box2i& window : kWindows) {
            if (layout.tile == 1 && window != kWindows[0] && window != kWindows[1]) continue;
            FilePart part = every_type();
            part.data = window;
            part.compression = layout.compression;
            part.tile = layout.tile;
            part.line_order = layout.order;
            parts.push_back(part);
            part.repeating = true;
            parts.push_back(part);
        }
    return parts;
}

std::string text_of(const FilePart& part) {
    return concat("compression ", int(part.compression), ", tile ", part.tile, ", order ",
                  int(part.line_order), ", window ", part.data.min.x, " ", part.data.min.y, " ",
                  part.data.max.x, " ", part.data.max.y, part.repeating ? ", repeating" : "");
}

// The file is the one that OpenEXR writes: header, table and chunks are equal byte by byte if
// nothing is deflated, or if zlib deflates as in OpenEXR.
TEST(ExrChunks, TheInputsOwnColorGivesTheFileThatOpenExrWrites) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr"), out = folder.path("out.exr");
    int same = 0;
    for (const int threads : {0, 3}) {
        set_exr_threads(threads);
        for (const FilePart& part : all_parts()) {
            SCOPED_TRACE(text_of(part));
            write_file(in, {part});
            InputFrame frame = read_ok(in);
            write_ok(out, frame, frame.planes.at(Role::color),
                     {.on_existing = OnExisting::overwrite, .zip_level = 4});
            ASSERT_TRUE(oiio_channels(in) == oiio_channels(out));
            if (part.compression != Imf::NO_COMPRESSION &&
                deflate_library() != std::string_view("zlib"))
                continue;
            ASSERT_TRUE(test::read_text(in) == test::read_text(out));
            ++same;
        }
    }
    set_exr_threads(0);
    EXPECT_GT(same, 20);
}

// Writes another color than the one that was read.
TEST(ExrChunks, NewColorBesideOldChannels) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr"), out = folder.path("out.exr");
    for (const FilePart& part : all_parts()) {
        SCOPED_TRACE(text_of(part));
        write_file(in, {part});
        InputFrame frame = read_ok(in);
        const ImageF color = new_color(frame);
        write_ok(out, frame, color, {.on_existing = OnExisting::overwrite});
        expect_only_color_changed(in, out, 0, kRgba, color);
    }
}

// Lines read alone or a few at a time equal those of the whole part.
TEST(ExrChunks, RowsAreThoseOfTheWhole) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    for (const Layout& layout : layouts()) {
        if (layout.tile == 1) continue;
        FilePart part = every_type();
        part.data = {{-7, -20}, {10, 19}};
        part.compression = layout.compression;
        part.tile = layout.tile;
        part.line_order = layout.order;
        part.repeating = true;
        SCOPED_TRACE(text_of(part));
        write_file(path, {part});
        Result<ExrFile> file = ExrFile::open(path);
        ASSERT_TRUE(file.ok());
        const Result<PartPixels> whole = file->read_part(0);
        ASSERT_TRUE(whole.ok());
        for (const auto& [first, last] :
             {std::pair(-20, -20), {-5, -4}, {-4, 11}, {-3, 12}, {19, 19}, {18, 40}}) {
            const Result<PartPixels> rows =
                file->read_part(0, {"G", "Z"}, Window{0, first, 0, last});
            ASSERT_TRUE(rows.ok()) << rows.status().message();
            ASSERT_EQ(rows->planes.size(), 2u);
            EXPECT_LE(rows->window.min_y, first);
            EXPECT_GE(rows->window.max_y, std::min(last, 19));
            for (const PartPixels::Plane& plane : rows->planes) {
                const PartPixels::Plane* all = whole->find(plane.channel.name);
                const size_t skipped = size_t(rows->window.min_y + 20) * plane.row_bytes();
                EXPECT_EQ(
                    std::memcmp(plane.bytes.get(), all->bytes.get() + skipped, plane.total_bytes()),
                    0);
            }
        }
    }
}

TEST(ExrChunks, SubsampledChannels) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr"), out = folder.path("out.exr");
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION}) {
        FilePart part = every_type();
        part.channels.push_back({"half_size", Imf::FLOAT, 2});
        part.channels.push_back({"quarter", Imf::HALF, 4});
        part.data = {{-8, -4}, {23, 39}};
        part.compression = compression;
        part.repeating = true;
        write_file(in, {part});
        InputFrame frame = read_ok(in);
        write_ok(out, frame, frame.planes.at(Role::color), {.on_existing = OnExisting::overwrite});
        // OpenImageIO converts such channels, so OpenEXR's own bytes are compared.
        if (compression == Imf::NO_COMPRESSION) {
            ASSERT_TRUE(test::read_text(in) == test::read_text(out));
        }
        Result<ExrFile> before = ExrFile::open(in), after = ExrFile::open(out);
        ASSERT_TRUE(before.ok() && after.ok());
        const Result<PartPixels> a = before->read_part(0), b = after->read_part(0);
        ASSERT_TRUE(a.ok() && b.ok());
        for (size_t c = 0; c < part.channels.size(); ++c) {
            const PartPixels::Plane* plane = a->find(part.channels[c].name);
            const PartPixels::Plane* again = b->find(part.channels[c].name);
            ASSERT_EQ(std::memcmp(plane->bytes.get(), again->bytes.get(), plane->total_bytes()), 0);
            const int s = part.channels[c].sampling;
            const size_t size = size_t(bytes_of(plane->channel.type));
            for (int y = 0; y < plane->height; ++y)
                for (int x = 0; x < plane->width; ++x) {
                    uint32_t bits = 0;
                    std::memcpy(&bits, plane->bytes.get() + size_t(y * plane->width + x) * size,
                                size);
                    ASSERT_EQ(bits, test::sample_bits(part, c, -8 + x * s, -4 + y * s));
                }
        }
    }
}

// Every chunk but the last, which is black, is stored unpacked: the file is larger than its pixels.
TEST(ExrChunks, WhatDoesNotBecomeSmallerIsStored) {
    const TempFolder folder;
    const std::string path = folder.path("noise.exr");
    std::mt19937 random(3);
    ImageF noise(64, 48, 2, 0.0f);
    for (size_t i = 0; i < size_t(64) * 32 * 2; ++i) {
        uint32_t bits;
        do bits = random();
        while ((bits & 0x7f800000u) == 0x7f800000u);
        std::memcpy(&noise.data[i], &bits, 4);
    }
    ASSERT_TRUE(write_planes_exr(path, noise, {"a", "b"}).ok());
    const size_t stored = 64 * 32 * 2 * 4, all = 64 * 48 * 2 * 4,
                 bytes = test::read_text(path).size();
    EXPECT_GT(bytes, stored + 3 * 16);
    EXPECT_LT(bytes, stored + (all - stored) / 4);
    const auto read = oiio_channels(path);
    for (size_t c = 0; c < 2; ++c) {
        const std::vector<char>& bytes_read = test::named(read, c == 0 ? "a" : "b").bytes;
        for (size_t p = 0; p < noise.pixels(); ++p)
            ASSERT_EQ(std::memcmp(&bytes_read[p * 4], &noise.data[p * 2 + c], 4), 0);
    }
    Result<ExrFile> file = ExrFile::open(path);
    ASSERT_TRUE(file.ok());
    const Result<ImageF> again = file->read_channels(0, {"a", "b"});
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(std::memcmp(again->data.data(), noise.data.data(), all), 0);
}

TEST(ExrChunks, HigherLevelsAreSmaller) {
    const TempFolder folder;
    FilePart part = every_type();
    part.data = {{0, 0}, {199, 199}};
    part.repeating = true;
    write_file(folder.path("in.exr"), {part});
    size_t last = size_t(-1);
    for (const int level : {0, 1, 9}) {
        const std::string path = folder.path(std::to_string(level));
        InputFrame frame = read_ok(folder.path("in.exr"));
        write_ok(path, frame, frame.planes.at(Role::color), {.zip_level = level});
        const size_t bytes = test::read_text(path).size();
        EXPECT_LT(bytes, last) << level;
        last = bytes;
    }
}

// Any part of a multi-part file.
TEST(ExrChunks, ColorInEachPart) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr"), out = folder.path("out.exr");
    for (int color = 0; color < 3; ++color)
        for (const auto compression :
             {Imf::NO_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION}) {
            std::vector<FilePart> parts;
            for (int i = 0; i < 3; ++i) {
                FilePart part = every_type(concat("part", i));
                part.compression = compression;
                part.repeating = true;
                part.tile = i == 1 ? 8 : 0;
                part.data.max.y += 17 * i;
                if (i != color) part.channels = {{"X", Imf::FLOAT}, {"Y", Imf::UINT}};
                parts.push_back(part);
            }
            write_file(in, parts);
            InputFrame frame = read_ok(in, color);
            const ImageF image = new_color(frame);
            write_ok(out, frame, image, {.on_existing = OnExisting::overwrite});
            expect_only_color_changed(in, out, color, kRgba, image);
            for (int i = 0; i < 3; ++i)
                if (i != color) {
                    EXPECT_TRUE(oiio_channels(in, i) == oiio_channels(out, i));
                }
        }
}

// --- damaged chunks -----------------------------------------------------------------------------

// Offset of the only chunk of a file, from its table.
size_t only_chunk(const std::string& bytes) {
    for (size_t at = 8; at + 8 < bytes.size(); ++at) {
        uint64_t place;
        std::memcpy(&place, bytes.data() + at, 8);
        if (place == at + 8) return at + 8;
    }
    ADD_FAILURE() << "no table with one chunk";
    return 0;
}

Status read_again(const std::string& path) {
    Result<ExrFile> file = ExrFile::open(path);
    if (!file.ok()) return file.status();
    return file->read_part(0).status();
}

void set_number(std::string& bytes, size_t at, int32_t value) {
    std::memcpy(bytes.data() + at, &value, 4);
}

class DamagedChunk : public testing::Test {
  protected:
    void make(int tile, const std::string& name = {}) {
        FilePart part{.name = name, .channels = {{"R"}, {"G"}, {"Z", Imf::FLOAT}}, .tile = tile};
        part.data = {{0, 5}, {9, 14}};
        part.repeating = true;
        write_file(path_, {part});
        bytes_ = test::read_text(path_);
        chunk_ = only_chunk(bytes_);
        ASSERT_TRUE(read_again(path_).ok());
    }
    std::string error(const std::function<void(std::string&)>& change) {
        std::string bytes = bytes_;
        change(bytes);
        test::write_text(path_, bytes);
        const Status status = read_again(path_);
        EXPECT_FALSE(status.ok());
        EXPECT_EQ(status.code(), StatusCode::input);
        EXPECT_THAT(status.message(), HasSubstr(path_));
        return status.message();
    }
    const TempFolder folder_;
    const std::string path_ = folder_.path("f.exr");
    std::string bytes_;
    size_t chunk_ = 0;  // its first byte
};

TEST_F(DamagedChunk, SizesThatAreNone) {
    make(0);
    const size_t size = chunk_ + 4;
    const int pixels = 10 * 10 * 8;
    for (const int32_t wrong :
         {-1, std::numeric_limits<int32_t>::min(), pixels + 1, std::numeric_limits<int32_t>::max()})
        EXPECT_THAT(error([&](std::string& b) { set_number(b, size, wrong); }),
                    AllOf(HasSubstr("lines 5 to 14"), HasSubstr("size")));
    // The stated size is that of an unpacked chunk, but the file has fewer bytes.
    EXPECT_THAT(error([&](std::string& b) { set_number(b, size, pixels); }),
                AllOf(HasSubstr("lines 5 to 14"), HasSubstr("truncated")));
    for (const int32_t wrong : {0, 1, 50})
        EXPECT_THAT(error([&](std::string& b) { set_number(b, size, wrong); }),
                    AllOf(HasSubstr("lines 5 to 14"), HasSubstr("unpack")));
}

TEST_F(DamagedChunk, AWrongChecksum) {
    make(0);
    EXPECT_THAT(error([](std::string& b) { b.back() = char(b.back() ^ 1); }),
                AllOf(HasSubstr("lines 5 to 14"), HasSubstr("unpack")));
}

TEST_F(DamagedChunk, AnotherOnesPlace) {
    make(0);
    EXPECT_THAT(error([&](std::string& b) { set_number(b, chunk_, 6); }),
                AllOf(HasSubstr("lines 5 to 14"), HasSubstr("another chunk")));
    make(16);
    for (size_t i = 0; i < 4; ++i)
        EXPECT_THAT(error([&](std::string& b) { set_number(b, chunk_ + 4 * i, 1); }),
                    AllOf(HasSubstr("tile (0, 5)-(9, 14)"), HasSubstr("another chunk")));
    make(0, "beauty");
    EXPECT_THAT(error([&](std::string& b) { set_number(b, chunk_, 1); }),
                HasSubstr("another chunk"));
}

// An unpacked chunk has no checksum, but must have exactly the size of its pixels.
TEST_F(DamagedChunk, UncompressedOfAnotherSize) {
    FilePart part{.channels = {{"R"}}};
    part.data = {{0, 0}, {9, 0}};
    part.compression = Imf::NO_COMPRESSION;
    write_file(path_, {part});
    bytes_ = test::read_text(path_);
    chunk_ = only_chunk(bytes_);
    for (const int32_t wrong : {0, 19, 21, -20})
        EXPECT_THAT(error([&](std::string& b) { set_number(b, chunk_ + 4, wrong); }),
                    AllOf(HasSubstr("lines 0 to 0"), HasSubstr("size")));
}

TEST_F(DamagedChunk, ThePartIsNamed) {
    FilePart first{.name = "first", .channels = {{"R"}}};
    FilePart second{.name = "second", .channels = {{"R"}}, .repeating = true};
    write_file(path_, {first, second});
    bytes_ = test::read_text(path_);
    bytes_.back() = char(bytes_.back() ^ 1);
    test::write_text(path_, bytes_);
    Result<ExrFile> file = ExrFile::open(path_);
    ASSERT_TRUE(file.ok());
    EXPECT_TRUE(file->read_part(0).ok());
    EXPECT_THAT(file->read_part(1).status().message(),
                AllOf(HasSubstr("part 1 'second'"), HasSubstr("lines 0 to 8")));
}

}  // namespace
}  // namespace postchain::io::test_exr_chunks
