// Every EXR that must be refused, and the required content of the message. Headers with false
// sizes: test_hostile_header.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/frame/frame_reader.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::read_text;
using test::rgba_z;
using test::TempFolder;
using test::write_file;
using test::write_text;
using testing::AllOf;
using testing::HasSubstr;

std::string open_error(const std::string& path, const ReadLimits& limits = {}) {
    const Result<ExrFile> file = ExrFile::open(path, limits);
    EXPECT_FALSE(file.ok()) << path;
    if (file.ok()) return "";
    EXPECT_EQ(file.status().code(), StatusCode::input);
    EXPECT_THAT(file.status().message(), HasSubstr(path));
    return file.status().message();
}

// Opens the file and reads every channel of every part; ok only if all could be read.
Status read_all(const std::string& path) {
    Result<ExrFile> file = ExrFile::open(path);
    if (!file.ok()) return file.status();
    for (size_t i = 0; i < file->parts().size(); ++i) {
        Result<PartPixels> pixels = file->read_part(int(i));
        if (!pixels.ok()) return pixels.status();
    }
    return {};
}

TEST(BadInput, WhatIsNoExrAtAll) {
    const TempFolder folder;
    EXPECT_THAT(open_error(folder.path("none.exr")), HasSubstr("no such file"));
    EXPECT_THAT(open_error(folder.path()), HasSubstr("is not a file"));
    const std::pair<std::string, const char*> texts[] = {
        {"", "zero bytes"},
        {"a text that was renamed", "not an EXR"},
        {"v/", "not an EXR"},
        {std::string("\x76\x2f\x31\x01\x01\0\0\0", 8), "version 1"}};
    for (const auto& [text, why] : texts) {
        write_text(folder.path("f.exr"), text);
        EXPECT_THAT(open_error(folder.path("f.exr")), HasSubstr(why));
    }
}

TEST(BadInput, TruncatedAtEveryLength) {
    const TempFolder folder;
    FilePart tiled = rgba_z("t");
    tiled.tile = 5;
    tiled.compression = Imf::ZIPS_COMPRESSION;
    FilePart mip = rgba_z();
    mip.tile = 4;
    mip.levels = Imf::MIPMAP_LEVELS;
    const std::vector<std::vector<FilePart>> files = {{rgba_z()}, {rgba_z("a"), tiled}, {mip}};
    for (size_t f = 0; f < files.size(); ++f) {
        const std::string path = folder.path("whole.exr");
        write_file(path, files[f]);
        ASSERT_TRUE(read_all(path).ok()) << read_all(path).message();
        const std::string whole = read_text(path);
        test::MemoryFile file;
        const std::string cut = file.path();
        for (size_t length = 0; length < whole.size(); ++length) {
            file.set(std::string_view(whole).substr(0, length));
            const Status s = read_all(cut);
            // Level 0 of a mip-mapped file may be whole while a smaller level is cut; the copy
            // of such a part is checked by the writer.
            if (f == 2 && s.ok()) continue;
            ASSERT_FALSE(s.ok()) << "file " << f << " cut at " << length << " of " << whole.size();
            ASSERT_EQ(s.code(), StatusCode::input);
        }
        file.set(std::string_view(whole).substr(0, whole.size() - 1));
        if (f < 2) {
            EXPECT_THAT(read_all(cut).message(), AllOf(HasSubstr(cut), HasSubstr("truncated")));
        }
    }
}

TEST(BadInput, FlippedBytesAreAnErrorOrPixelsButNoCrash) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart tiled = rgba_z("t");
    tiled.tile = 8;
    test::MemoryFile file;
    int refused = 0;
    int read = 0;
    for (const std::vector<FilePart>& parts : {std::vector{rgba_z()}, {rgba_z("a"), tiled}}) {
        write_file(path, parts);
        const std::string whole = read_text(path);
        for (size_t at = 0; at < whole.size(); ++at) {
            constexpr int kFlips[] = {0x01, 0x80, 0xff};
            std::string bytes = whole;
            bytes[at] = char(bytes[at] ^ kFlips[at % 3]);
            file.set(bytes);
            const Status s = read_all(file.path());
            (s.ok() ? read : refused) += 1;
            ASSERT_TRUE(s.ok() || s.code() == StatusCode::input) << s.message();
        }
    }
    EXPECT_GT(refused, 300);
    EXPECT_GT(read, 0);  // attributes that are not checked
}

TEST(BadInput, AFileWhoseWriterDidNotFinish) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    write_file(path, {rgba_z()});
    std::string bytes = read_text(path);
    // 9 lines of ZIP are one chunk.
    std::memset(bytes.data() + test::chunk_table_of(bytes, 1), 0, 8);
    write_text(path, bytes);
    EXPECT_THAT(open_error(path), HasSubstr("incomplete"));
}

TEST(BadInput, SixteenThousandThreeHundredAndEightyFiveIsTooWide) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    for (const auto& [width, height] : {std::pair(16384, 2), {2, 16384}, {16385, 2}, {2, 16385}}) {
        FilePart part{.channels = {{"R"}}};
        part.data = part.display = {{0, 0}, {width - 1, height - 1}};
        write_file(path, {part});
        if (std::max(width, height) == 16384)
            EXPECT_TRUE(read_all(path).ok()) << read_all(path).message();
        else
            EXPECT_THAT(open_error(path),
                        AllOf(HasSubstr(concat(width, "x", height)), HasSubstr("16384")));
    }
}

std::string read_error(const std::string& path, const ChannelAssignment& roles,
                       RoleSet wanted = {Role::color}) {
    Result<OpenFrame> open = open_frame({{Role::color, path}}, 1);
    EXPECT_TRUE(open.ok()) << open.status().message();
    if (!open.ok()) return "";
    const Result<InputFrame> frame = read_frame(*open, roles, wanted, Keep::all);
    EXPECT_FALSE(frame.ok());
    EXPECT_EQ(frame.status().code(), StatusCode::input);
    EXPECT_THAT(frame.status().message(), HasSubstr(path));
    return frame.status().message();
}

TEST(BadInput, DeepPartsWithoutDepthOrOneAlpha) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart deep{.name = "beauty",
                  .channels = {{"R", Imf::FLOAT}, {"G", Imf::FLOAT}, {"B", Imf::FLOAT}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    write_file(path, {deep});
    EXPECT_THAT(read_error(path, {{Role::color, {0, {"R", "G", "B"}}}}),
                AllOf(HasSubstr("is deep without a channel Z"), HasSubstr("'beauty'")));
    deep.tile = 4;
    write_file(path, {deep});
    EXPECT_THAT(read_error(path, {{Role::color, {0, {"R", "G", "B"}}}}), HasSubstr("deep"));
    deep.channels = {{"R"}, {"AR"}, {"Z", Imf::FLOAT}};
    write_file(path, {deep});
    EXPECT_THAT(
        read_error(path, {{Role::color, {0, {"R", "R", "R"}}}}),
        HasSubstr("an alpha for each color (AR), which cannot be read; write one alpha, A"));
    auto file = must(ExrFile::open(path));
    EXPECT_FALSE(file.read_part(0).ok());
}

TEST(BadInput, LuminanceChromaAndSubsampledChannels) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart yc{.channels = {{"Y"}, {"RY", Imf::HALF, 2}, {"BY", Imf::HALF, 2}},
                .data = {{0, 0}, {15, 7}},
                .display = {{0, 0}, {15, 7}}};
    write_file(path, {yc});
    EXPECT_THAT(read_error(path, {}), HasSubstr("luminance-chroma"));
    EXPECT_THAT(read_error(path, {{Role::color, {0, {"Y", "RY", "BY"}}}}),
                HasSubstr("luminance-chroma"));
    FilePart sub = yc;
    sub.channels = {{"R"}, {"G"}, {"B", Imf::HALF, 2}};
    write_file(path, {sub});
    EXPECT_THAT(read_error(path, {{Role::color, {0, {"R", "G", "B"}}}}),
                AllOf(HasSubstr("channel B"), HasSubstr("subsampled 2x2")));
}

TEST(BadInput, ARoleThatIsNotThere) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    write_file(path, {rgba_z()});
    const ChannelAssignment color = {{Role::color, {0, {"R", "G", "B", "A"}}}};
    EXPECT_THAT(read_error(path, color, {Role::motion}), HasSubstr("motion"));
    ChannelAssignment wrong = color;
    wrong[Role::inverse_depth] = {0, {"depth.Z"}};
    EXPECT_THAT(read_error(path, wrong, {Role::inverse_depth}),
                AllOf(HasSubstr("no channel depth.Z"), HasSubstr("A, B, G, R, Z")));
    wrong[Role::inverse_depth] = {3, {"Z"}};
    EXPECT_THAT(read_error(path, wrong, {Role::inverse_depth}), HasSubstr("no part 3"));
    wrong[Role::inverse_depth] = {0, {"Z", "A"}};
    EXPECT_THAT(read_error(path, wrong, {Role::inverse_depth}), HasSubstr("2 channels"));
}

}  // namespace
}  // namespace postchain::io
