// Every EXR that must be refused, and the required content of the message. Headers with false
// sizes: test_hostile_header.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/planes/frame_reader.h"

namespace postchain::io {
namespace {

using test::bytes_of_file;
using test::FilePart;
using test::must;
using test::read_whole;
using test::rgba_z;
using test::write_file;
using test::write_text;
using testing::AllOf;
using testing::HasSubstr;

using BadInput = InOut;

std::string open_error(const std::string& path, const ReadLimits& limits = {}) {
    const Result<ExrFile> file = ExrFile::open(path, limits);
    EXPECT_FALSE(file.ok()) << path;
    if (file.ok()) return "";
    EXPECT_EQ(file.status().code(), StatusCode::input);
    EXPECT_THAT(file.status().message(), HasSubstr(path));
    return file.status().message();
}

TEST_F(BadInput, WhatIsNoExrAtAll) {
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

TEST_F(BadInput, AFileWhoseWriterDidNotFinish) {
    std::string bytes = bytes_of_file({rgba_z()});
    // 9 lines of ZIP are one chunk.
    std::memset(bytes.data() + test::chunk_table_of(bytes, 1), 0, 8);
    write_text(folder.path("f.exr"), bytes);
    EXPECT_THAT(open_error(folder.path("f.exr")), HasSubstr("incomplete"));
}

TEST_F(BadInput, SixteenThousandThreeHundredAndEightyFiveIsTooWide) {
    for (const auto& [width, height] : {std::pair(16384, 2), {2, 16384}, {16385, 2}, {2, 16385}}) {
        FilePart part{.channels = {{"R"}}};
        part.data = part.display = {{0, 0}, {width - 1, height - 1}};
        write_file(in, {part});
        if (std::max(width, height) == 16384)
            EXPECT_TRUE(read_whole(in).ok()) << read_whole(in).message();
        else
            EXPECT_THAT(open_error(in),
                        AllOf(HasSubstr(concat(width, "x", height)), HasSubstr("16384")));
    }
}

std::string read_error(const std::string& path, const FrameChannels& roles,
                       RoleSet wanted = {Role::color}) {
    const Status status =
        read_frame(must(open_frame({{Role::color, path}}, 1)), roles, wanted, Keep::all).status();
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_THAT(status.message(), HasSubstr(path));
    return status.message();
}

TEST_F(BadInput, DeepPartsWithoutDepthOrOneAlpha) {
    FilePart deep{.name = "beauty",
                  .channels = {{"R", Imf::FLOAT}, {"G", Imf::FLOAT}, {"B", Imf::FLOAT}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    write_file(in, {deep});
    EXPECT_THAT(read_error(in, {{Role::color, {0, {"R", "G", "B"}}}}),
                AllOf(HasSubstr("is deep without a channel Z"), HasSubstr("'beauty'")));
    deep.channels = {{"R"}, {"AR"}, {"Z", Imf::FLOAT}};
    write_file(in, {deep});
    EXPECT_THAT(
        read_error(in, {{Role::color, {0, {"R", "R", "R"}}}}),
        HasSubstr("an alpha for each color (AR), which cannot be read; write one alpha, A"));
    EXPECT_FALSE(read_whole(in).ok());
}

TEST_F(BadInput, LuminanceChromaAndSubsampledChannels) {
    FilePart yc{.channels = {{"Y"}, {"RY", Imf::HALF, 2}, {"BY", Imf::HALF, 2}, {"Z"}},
                .data = {{0, 0}, {15, 7}},
                .display = {{0, 0}, {15, 7}}};
    write_file(in, {yc});
    EXPECT_THAT(read_error(in, {}), HasSubstr("luminance-chroma"));
    EXPECT_THAT(read_error(in, {{Role::color, {0, {"Y", "RY", "BY"}}}}),
                HasSubstr("luminance-chroma"));
    EXPECT_TRUE(must(ExrFile::open(in)).check_channels(0, {"Z"}).ok()) << "beside them";
    for (const char* chroma : {"RY", "BY"}) {
        FilePart one = yc;
        one.channels = {{"Y"}, {chroma, Imf::HALF, 2}};
        write_file(in, {one});
        EXPECT_THAT(read_error(in, {}), HasSubstr("luminance-chroma")) << chroma;
    }
    FilePart sub = yc;
    for (const auto& [x, y, words] :
         {std::tuple(2, 2, "2x2"), std::tuple(2, 1, "2x1"), std::tuple(1, 2, "1x2")}) {
        sub.channels = {{"R"}, {"G"}, {"B", Imf::HALF, x, y}};
        write_file(in, {sub});
        EXPECT_THAT(read_error(in, {{Role::color, {0, {"R", "G", "B"}}}}),
                    AllOf(HasSubstr("channel B"), HasSubstr(std::string("subsampled ") + words)));
    }
}

TEST_F(BadInput, ARoleThatIsNotThere) {
    write_file(in, {rgba_z()});
    const FrameChannels color = {{Role::color, {0, {"R", "G", "B", "A"}}}};
    EXPECT_THAT(read_error(in, color, {Role::motion}), HasSubstr("motion"));
    FrameChannels wrong = color;
    wrong[Role::inverse_depth] = {0, {"depth.Z"}};
    EXPECT_THAT(read_error(in, wrong, {Role::inverse_depth}),
                AllOf(HasSubstr("no channel depth.Z"), HasSubstr("A, B, G, R, Z")));
    wrong[Role::inverse_depth] = {3, {"Z"}};
    EXPECT_THAT(read_error(in, wrong, {Role::inverse_depth}), HasSubstr("no part 3"));
    wrong[Role::inverse_depth] = {0, {"Z", "A"}};
    EXPECT_THAT(read_error(in, wrong, {Role::inverse_depth}), HasSubstr("2 channels"));
}

}  // namespace
}  // namespace postchain::io
