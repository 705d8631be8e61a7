// ExrSettings: compression, half, channels of an output. The changes that a compression makes are
// found by writing a file with OpenEXR and reading it back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/written_files.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::oiio_channels;
using test::write_file;
using testing::HasSubstr;

constexpr const char* kMethods[] = {"none",  "rle", "zips", "zip",  "piz",
                                    "pxr24", "b44", "b44a", "dwaa", "dwab"};

ExrCompression compression_of(const std::string& text) {
    const auto parsed = ExrCompression::parse(text);
    EXPECT_TRUE(parsed.ok()) << parsed.status().message();
    return parsed.ok() ? *parsed : ExrCompression();
}

TEST_F(ExrOutputSettings, WhatACompressionChangesIsWhatOpenExrGivesBackChanged) {
    FilePart part;
    part.data = part.display = {{0, 0}, {63, 47}};
    for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT, Imf::UINT})
        for (const char* name : {"R", "G", "Y", "RY", "A", "Z", "r", "N.B", "crypto00.red"})
            part.channels.push_back({"t" + std::to_string(int(type)) + "." + name, type});
    write_file(folder.path("lossless.exr"), {part});
    const auto before = oiio_channels(folder.path("lossless.exr"));
    for (const char* method : kMethods) {
        const ExrCompression compression = compression_of(method);
        part.compression = Imf::Compression(compression.method);
        write_file(folder.path("packed.exr"), {part});
        const auto after = oiio_channels(folder.path("packed.exr"));
        ASSERT_EQ(after.size(), before.size());
        for (size_t c = 0; c < before.size(); ++c) {
            ExrChannel channel{before[c].name};
            channel.type = before[c].type == "half"    ? PixelType::half
                           : before[c].type == "float" ? PixelType::float32
                                                       : PixelType::uint32;
            EXPECT_EQ(after[c].bytes != before[c].bytes, compression.changes(channel))
                << method << " " << channel.name;
        }
    }
}

TEST_F(ExrOutputSettings, CompressionIsParsed) {
    for (const char* method : kMethods)
        EXPECT_STREQ(name_of(compression_of(method).method), method);
    EXPECT_EQ(compression_of("zip:9").level, 9);
    EXPECT_EQ(compression_of("dwaa:12.5").level, 12.5f);
    EXPECT_FALSE(compression_of("dwaa").level);
    for (const char* wrong : {"", "ZIP", "zip:", "zip:0", "zip:10", "zip:2.5", "zip:4x", "rle:1",
                              "piz:3", "dwaa:-1", "dwab:nan", "dwab:1001", "b44:", "lzw"})
        EXPECT_EQ(ExrCompression::parse(wrong).status().code(), StatusCode::usage) << wrong;
}

TEST_F(ExrOutputSettings, PatternsOfChannels) {
    const char* kRed = "ViewLayer.Combined.R";
    for (const auto& [pattern, name] :
         {std::pair("R", "R"), {"*", ""}, {"*.R", kRed}, {"View*.Comb*.*", kRed}})
        EXPECT_TRUE(matches(pattern, name)) << pattern;
    for (const auto& [pattern, name] : {std::pair("R", "RY"), {"View*.X", kRed}, {"", "R"}})
        EXPECT_FALSE(matches(pattern, name)) << pattern;
}

FilePart color_and_data() {
    FilePart part{.channels = {{"diffuse.R"}, {"id", Imf::UINT}}};
    for (const char* name : {"R", "G", "B", "A", "Z"}) part.channels.push_back({name, Imf::FLOAT});
    return part;
}

TEST_F(ExrOutputSettings, EachCompressionAndLevelArrivesAndKeepsWhatItMustKeep) {
    FilePart part = color_and_data();
    part.channels.erase(part.channels.begin() + 1);
    part.channels.back().type = Imf::HALF;  // a Z that PXR24 keeps
    write_file(in, {part});
    const auto before = oiio_channels(in);
    for (const char* text : {"none", "rle", "zips:1", "zip:9", "piz", "pxr24", "dwaa:9", "dwab"}) {
        ReadFile frame = read_ok(in);
        WriteOptions options{.on_existing = OnExisting::overwrite};
        options.exr.compression = compression_of(text);
        const WriteReport report = write_ok(out, frame, new_color(frame), options);
        const std::string whole = text;
        const auto attributes = ExrFile::open(out)->parts()[0].attributes;
        EXPECT_EQ(attributes.at("compression"), whole.substr(0, whole.find(':')));
        EXPECT_TRUE(test::named(oiio_channels(out), "Z").bytes == test::named(before, "Z").bytes)
            << text;
        const bool dwa = options.exr.compression->is_dwa();
        EXPECT_EQ(report.notes.size(), dwa ? 1u : 0u) << text;  // diffuse.R is changed, and noted
        if (whole == "dwaa:9") {
            EXPECT_EQ(attributes.at("dwaCompressionLevel"), "9");
        }
    }
}

// The level of zip is not in the file; the size shows it.
TEST_F(ExrOutputSettings, HigherLevelsOfZipAreSmaller) {
    FilePart part = every_type();
    part.data = {{0, 0}, {119, 119}};
    part.repeating = true;
    write_file(in, {part});
    ReadFile frame = read_ok(in);
    const auto bytes_with = [&](WriteOptions options) {
        options.on_existing = OnExisting::overwrite;
        return write_ok(out, frame, frame.planes.at(Role::color), options).bytes;
    };
    EXPECT_GT(bytes_with({.zip_level = 0}), bytes_with({.zip_level = 1}));
    EXPECT_GT(bytes_with({.zip_level = 1}), bytes_with({.zip_level = 9}));
    WriteOptions named;
    named.exr.compression = compression_of("zip:9");
    EXPECT_EQ(bytes_with(named), bytes_with({.zip_level = 9}));
}

TEST_F(ExrOutputSettings, LossyIsRefusedWhereItWouldChangeDataAndNamesIt) {
    write_file(in, {color_and_data()});
    ReadFile frame = read_ok(in);
    WriteOptions options;
    options.exr.compression = compression_of("pxr24");
    const Status refused = write_filtered(out, frame, new_color(frame), options).status();
    EXPECT_EQ(refused.code(), StatusCode::usage);
    EXPECT_THAT(refused.message(), HasSubstr("would change Z,"));
    EXPECT_EQ(folder.names(), std::vector<std::string>{"in.exr"});
    // Channels that are left out cannot change.
    options.exr.channels = {"R", "G", "B"};
    EXPECT_TRUE(write_filtered(out, frame, new_color(frame), options).ok());
}

TEST_F(ExrOutputSettings, HalfMakesFloatColorHalfAndNothingElse) {
    write_file(in, {color_and_data()});
    ReadFile frame = read_ok(in);
    WriteOptions options;
    options.exr.half = true;
    ImageF color = new_color(frame);
    write_ok(out, frame, color, options);
    const auto before = oiio_channels(in);
    for (const auto& channel : oiio_channels(out)) {
        const bool is_color = std::string("RGBA").find(channel.name) != std::string::npos;
        if (is_color) {
            EXPECT_EQ(channel.type, "half") << channel.name;
        } else {
            EXPECT_TRUE(channel == test::named(before, channel.name)) << channel.name;
        }
    }
    // new_color() is exact in half.
    EXPECT_EQ(ExrFile::open(out)->read_channels(0, kRgba)->data, color.data);
    color.at(3, 2, 1) = 70000;
    options.on_existing = OnExisting::overwrite;
    EXPECT_THAT(write_filtered(out, frame, color, options).status().message(),
                HasSubstr("or leave {half} out"_keyed));
}

TEST_F(ExrOutputSettings, ChannelsThatAreNamedAreWrittenAndNoOthers) {
    FilePart beauty = color_and_data(), depth{.name = "depth", .channels = {{"far.Z"}}},
             other{.name = "other", .channels = {{"n.X"}, {"n.Y"}}};
    beauty.name = "beauty";
    write_file(in, {depth, beauty, other});
    const auto names_of = [&](const std::vector<std::string>& patterns) {
        ReadFile frame = read_ok(in, 1);
        WriteOptions options{.on_existing = OnExisting::overwrite};
        options.exr.channels = patterns;
        const auto report = write_filtered(out, frame, new_color(frame), options);
        if (!report.ok()) return report.status().message();
        std::string names;
        for (int part = 0; part < int(ExrFile::open(out)->parts().size()); ++part) {
            names += "|";
            for (const auto& channel : oiio_channels(out, part)) {
                names += channel.name + " ";
                if (channel.name != "Z" && channel.name != "n.X") continue;
                const auto before = oiio_channels(in, channel.name == "Z" ? 1 : 2);
                EXPECT_TRUE(channel == test::named(before, channel.name)) << channel.name;
            }
        }
        return names;
    };
    EXPECT_EQ(names_of({}), "|far.Z |R G B A Z id diffuse.R |n.X n.Y ");
    EXPECT_EQ(names_of({"R", "G", "B"}), "|R G B ");
    EXPECT_EQ(names_of({"*R", "Z", "n.*"}), "|R Z diffuse.R |n.X n.Y ");
    EXPECT_THAT(names_of({"R", "depth"}), HasSubstr("no channel depth; there are far.Z, "));
    EXPECT_THAT(names_of({"Z"}), HasSubstr("names no channel of color"));
    EXPECT_THAT(names_of({"R", "n.X"}), HasSubstr("names some channels of part 2 'other'"));
}

}  // namespace
}  // namespace postchain::io
