// Writing a frame with a larger data window than its file has.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/planes/frame_writer.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::oiio_channels;
using test::TempFolder;
using test::write_file;
using testing::HasSubstr;

// Stored values of no motion.
TEST(GrownWindow, VectorsAroundHaveTheirOwnBias) {
    ConvertOptions convention;
    convention.motion.bias = 0.25;
    convention.motion_back.bias = 0.5;
    EXPECT_EQ(outside_value(Role::motion, convention, PixelType::half), 0.25f);
    EXPECT_EQ(outside_value(Role::motion_back, convention, PixelType::half), 0.5f);
}

TEST(Window, OfOneColumnOrRowIsNotEmpty) {
    const Window column{3, 0, 3, 4}, row{0, 3, 4, 3};
    for (const Window& one : {column, row}) EXPECT_EQ(one.pixels(), 5u);
    EXPECT_EQ(column.intersected(row), (Window{3, 3, 3, 3}));
    for (const Window& beside : {Window{4, 0, 9, 4}, Window{0, 5, 9, 9}}) {
        EXPECT_TRUE(column.intersected(beside).empty());
        EXPECT_EQ(column.intersected(beside).pixels(), 0u);
    }
}

// A larger data window than the file's, in parts of every kind: new pixels are clear, infinitely
// far and still; samples of subsampled channels stay at their pixels.
TEST(GrownWindow, WhatIsAroundTheFilesPixels) {
    TempFolder folder;
    FilePart beauty;
    for (const char* name : {"R", "G", "B", "A", "mask", "small"})
        beauty.channels.push_back({name, Imf::HALF});
    beauty.channels.back().x_sampling = 2;
    beauty.channels.back().y_sampling = 3;
    for (const auto& [name, type] : {std::pair("Z", Imf::FLOAT),
                                     {"half.Z", Imf::HALF},
                                     {"mv.x", Imf::FLOAT},
                                     {"mv.y", Imf::FLOAT},
                                     {"id", Imf::UINT}})
        beauty.channels.push_back({name, type});
    beauty.data = {{-4, 6}, {9, 17}};
    beauty.display = {{-10, 0}, {30, 24}};
    struct Case {
        const char* name;
        int tile;
        bool parts;
        Imf::Compression compression;
        Imf::PixelType depth = Imf::FLOAT;
        int at = 0;  // the part of color
    };
    for (const Case& one : {Case{"lines", 0, false, Imf::ZIP_COMPRESSION},
                            Case{"half_depth", 0, false, Imf::ZIP_COMPRESSION, Imf::HALF},
                            Case{"tiles", 8, false, Imf::PIZ_COMPRESSION},
                            Case{"parts", 0, true, Imf::RLE_COMPRESSION},
                            Case{"tiled_parts", 8, true, Imf::NO_COMPRESSION},
                            Case{"second_part", 0, true, Imf::ZIP_COMPRESSION, Imf::FLOAT, 1}}) {
        SCOPED_TRACE(one.name);
        FilePart colored = beauty;
        colored.tile = one.tile;
        colored.compression = one.compression;
        colored.channels[6].type = one.depth;
        const bool half = one.depth == Imf::HALF;
        const float far = half ? std::numeric_limits<float>::infinity() : 1e10f;
        // Tiles cannot have subsampled channels, and OpenImageIO cannot read files with them.
        const bool sampled = !one.tile && !one.parts;
        if (!sampled) colored.channels.erase(colored.channels.begin() + 5);
        if (one.parts) colored.name = "beauty";
        std::vector<FilePart> parts = {colored};
        const int at = one.at, other = 1 - at;
        if (one.parts)
            parts.insert(
                parts.begin() + other,
                {.name = "other", .channels = {{"X", Imf::FLOAT}}, .display = beauty.display});
        const std::string in = folder.path(std::string(one.name) + ".exr"),
                          out = folder.path(std::string(one.name) + "_out.exr");
        write_file(in, parts);
        const FrameChannels roles = {{Role::color, {at, kRgba}},
                                     {Role::inverse_depth, {at, {"Z"}}},
                                     {Role::motion, {at, {"mv.x", "mv.y"}}}};
        PlanesArea area{{-10, 0, 30, 24}, {}};
        area.convention.motion.bias = 0.5;
        const ReadFile frame = read_file(in, roles, {Role::inverse_depth, Role::motion}, area);
        // The planes, with the pixels around them.
        EXPECT_EQ(frame.planes.at(Role::color).width, 41);
        EXPECT_EQ(frame.planes.at(Role::color).height, 25);
        EXPECT_EQ(frame.planes.at(Role::inverse_depth).at(0, 0), far);
        EXPECT_EQ(frame.planes.at(Role::motion).at(40, 24, 1), 0.5f);
        EXPECT_EQ(frame.planes.at(Role::color).at(5, 12, 3), 0);
        EXPECT_EQ(frame.planes.at(Role::color).at(6, 6, 3), test::sample_value(colored, 3, -4, 6));
        const ImageF color = new_color(frame);
        WriteOptions options;
        options.window = Window{-7, 4, 12, 19};
        const auto report = must(write_filtered(out, frame, color, options));
        EXPECT_THAT(report.notes,
                    testing::Contains(HasSubstr("data window (-4, 6)-(9, 17) grown")));
        const Window expected = sampled ? Window{-8, 3, 13, 20} : *options.window;
        auto file = must(ExrFile::open(out));
        EXPECT_EQ(file.parts()[size_t(at)].data_window, expected);
        EXPECT_EQ(file.parts()[size_t(at)].display_window, (Window{-10, 0, 30, 24}));
        EXPECT_EQ(*file.read_channels(at, kRgba), placed(color, frame.window, expected));
        const auto pixels = must(file.read_part(at));
        for (size_t c = 4; c < colored.channels.size(); ++c) {
            const std::string name = colored.channels[c].name;
            // half.Z is of no plane.
            const float outside = name == "Z" ? far : name.starts_with("mv.") ? 0.5f : 0;
            const bool half_infinity = half && name == "Z";
            expect_channel(pixels, colored, c,
                           half_infinity ? 0x7c00u : std::bit_cast<uint32_t>(outside));
        }
        if (one.parts) {
            EXPECT_EQ(oiio_channels(in, other), oiio_channels(out, other));
        }
        if (!sampled) {
            EXPECT_EQ(oiio_channels(out, at).size(), colored.channels.size());
        }
    }
    // Half depth cannot hold a distance of 1e10.
    EXPECT_EQ(outside_value(Role::inverse_depth, {}, PixelType::half),
              std::numeric_limits<float>::infinity());
}

}  // namespace
}  // namespace postchain::io
