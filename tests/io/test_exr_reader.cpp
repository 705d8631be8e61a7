#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <ImfChromaticities.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <bit>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::io::test_exr_reader {
namespace {

using test::FilePart;
using test::must;
using test::TempFolder;
using test::write_file;
using testing::ElementsAre;

// Compares every sample of the part, in its own type, with the bits it was made from.
void expect_samples(const std::string& path, int part, const FilePart& made) {
    ExrFile file = must(ExrFile::open(path));
    const Result<PartPixels> pixels = file.read_part(part);
    ASSERT_TRUE(pixels.ok()) << pixels.status().message();
    ASSERT_EQ(pixels->planes.size(), made.channels.size());
    for (size_t c = 0; c < made.channels.size(); ++c) {
        const int s = made.channels[c].sampling;
        const PartPixels::Plane* plane = pixels->find(made.channels[c].name);
        ASSERT_NE(plane, nullptr);
        const size_t size = size_t(bytes_of(plane->channel.type));
        for (int y = 0; y < plane->height; ++y) {
            for (int x = 0; x < plane->width; ++x) {
                uint32_t bits = 0;
                std::memcpy(
                    &bits,
                    plane->bytes.get() + (size_t(y) * size_t(plane->width) + size_t(x)) * size,
                    size);
                ASSERT_EQ(bits, test::sample_bits(made, c, made.data.min.x + x * s,
                                                  made.data.min.y + y * s))
                    << made.channels[c].name << " at " << x << ", " << y;
            }
        }
    }
}

FilePart every_type() {
    return {.channels = {{"A"}, {"B"}, {"G"}, {"R"}, {"Z", Imf::FLOAT}, {"id", Imf::UINT}},
            .special_values = true};
}

class Compression : public testing::TestWithParam<Imf::Compression> {};

TEST_P(Compression, EveryBitOfScanlinesAndTiles) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    for (const int tile : {0, 5}) {
        for (const auto order : {Imf::INCREASING_Y, Imf::DECREASING_Y}) {
            FilePart part = every_type();
            part.compression = GetParam();
            part.tile = tile;
            part.line_order = order;
            part.data = {{-7, -3}, {20, 35}};
            write_file(path, {part});
            expect_samples(path, 0, part);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Lossless, Compression,
                         testing::Values(Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION,
                                         Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
                                         Imf::PIZ_COMPRESSION));

TEST(ExrReader, EveryBitOfOtherForms) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart one = every_type(), outside = one, wide = one, sampled = one, mip = one;
    one.data = one.display = {{0, 0}, {0, 0}};
    outside.data = {{-4, -6}, {10, 12}};
    outside.display = {{0, 0}, {99, 49}};
    wide.channels = {{"R"}, {"Z", Imf::FLOAT}};
    wide.data = wide.display = {{0, 0}, {16383, 2}};  // the limit
    sampled.channels = {{"R"}, {"sub", Imf::FLOAT, 2}};
    sampled.data = {{-4, -2}, {11, 7}};
    mip.tile = 4;
    mip.levels = Imf::MIPMAP_LEVELS;  // level 0 is read
    FilePart rip = mip;
    rip.levels = Imf::RIPMAP_LEVELS;
    for (const auto& [what, part] : {std::pair("one pixel", one),
                                     {"windows that differ", outside},
                                     {"wide", wide},
                                     {"subsampled", sampled},
                                     {"mip-mapped", mip},
                                     {"rip-mapped", rip}}) {
        SCOPED_TRACE(what);
        write_file(path, {part});
        expect_samples(path, 0, part);
        EXPECT_EQ(must(ExrFile::open(path)).parts()[0].mip_mapped, part.tile > 0);
    }
}

TEST(ExrReader, WindowsNeedNotAgree) {
    const TempFolder folder;
    FilePart part{.channels = {{"R"}}, .data = {{-4, -6}, {10, 12}}, .display = {{0, 0}, {99, 49}}};
    part.edit = [](Imf::Header& h) { h.pixelAspectRatio() = 2; };
    write_file(folder.path("f.exr"), {part});
    const ExrFile file = must(ExrFile::open(folder.path("f.exr")));
    const ExrPart& p = file.parts()[0];
    EXPECT_EQ(p.data_window, (Window{-4, -6, 10, 12}));
    EXPECT_EQ(p.data_window.width(), 15);
    EXPECT_EQ(p.data_window.height(), 19);
    EXPECT_EQ(p.display_window, (Window{0, 0, 99, 49}));
    EXPECT_EQ(p.pixel_aspect, 2);
}

TEST(ExrReader, PartsViewsAndTypes) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart left = every_type();
    left.name = "rgba.left";
    left.edit = [](Imf::Header& h) { h.setView("left"); };
    FilePart depth{.name = "depth", .channels = {{"Z", Imf::FLOAT}}, .tile = 4};
    FilePart deep{.name = "deep",
                  .channels = {{"Z", Imf::FLOAT}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    write_file(path, {left, depth, deep});
    ExrFile file = must(ExrFile::open(path));
    ASSERT_EQ(file.parts().size(), 3u);
    EXPECT_EQ(file.parts()[0].name, "rgba.left");
    EXPECT_EQ(file.parts()[0].view, "left");
    EXPECT_EQ(file.parts()[0].type, "scanlineimage");
    EXPECT_EQ(file.parts()[1].type, "tiledimage");
    EXPECT_TRUE(file.parts()[1].tiled);
    EXPECT_EQ(file.parts()[2].type, "deepscanline");
    EXPECT_TRUE(file.parts()[2].deep);
    EXPECT_EQ(file.parts()[0].find("id")->type, PixelType::uint32);
    EXPECT_EQ(file.parts()[0].find("none"), nullptr);
    expect_samples(path, 0, left);
    expect_samples(path, 1, depth);
}

TEST(ExrReader, ReadsOnlyTheChannelsAskedFor) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart part = every_type();
    part.special_values = false;
    write_file(path, {part});
    ExrFile file = must(ExrFile::open(path));
    const auto pixels = must(file.read_part(0, {"Z", "R"}));
    EXPECT_EQ(pixels.planes.size(), 2u);
    // Channels are in the order of the names; the file's order is alphabetical.
    const auto image = must(file.read_channels(0, {"Z", "R", "id"}));
    ASSERT_EQ(image.channels, 3);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            EXPECT_EQ(image.at(x, y, 0), test::sample_value(part, 4, x, y));
            EXPECT_EQ(image.at(x, y, 1), test::sample_value(part, 3, x, y));
            EXPECT_EQ(image.at(x, y, 2), test::sample_value(part, 5, x, y));
        }
    }
    EXPECT_FALSE(file.read_channels(0, {"Q"}).ok());
    EXPECT_FALSE(file.read_part(1).ok());
}

TEST(ExrReader, CropAndFill) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart part = every_type();
    part.data = {{-2, -3}, {9, 8}};
    write_file(path, {part});
    ExrFile file = must(ExrFile::open(path));
    const auto pixels = must(file.read_part(0));
    const ImageF image = pixels.interleaved({"R"}, {1, 2, 3, 5}, 4, 7);
    EXPECT_EQ(image.width, 3);
    EXPECT_EQ(image.height, 4);
    EXPECT_EQ(image.channels, 4);
    EXPECT_EQ(image.at(0, 0, 0), test::sample_value(part, 3, 1, 2));
    EXPECT_EQ(image.at(2, 3, 0), test::sample_value(part, 3, 3, 5));
    EXPECT_EQ(image.at(2, 3, 1), 7);
    EXPECT_EQ(image.at(2, 3, 3), 7);
}

TEST(ExrReader, AllHalvesBecomeTheirFloats) {
    // All 65536 patterns, against Imath's table.
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart part{.channels = {{"id", Imf::UINT}}};
    part.data = part.display = {{0, 0}, {255, 255}};
    write_file(path, {part});
    ExrFile file = must(ExrFile::open(path));
    auto pixels = must(file.read_part(0));
    PartPixels::Plane& plane = pixels.planes[0];
    plane.channel.type = PixelType::half;
    plane.channel.name = "h";
    for (uint32_t i = 0; i < 65536; ++i) {
        const auto bits = uint16_t(i);
        std::memcpy(plane.bytes.get() + i * 2, &bits, 2);
    }
    const ImageF image = pixels.interleaved({"h"}, pixels.window);
    for (uint32_t i = 0; i < 65536; ++i) {
        half h;
        h.setBits(uint16_t(i));
        const float expected = float(h);
        if (std::isnan(expected)) {
            ASSERT_TRUE(std::isnan(image.data[i])) << i;
        } else {
            ASSERT_EQ(std::bit_cast<uint32_t>(image.data[i]), std::bit_cast<uint32_t>(expected));
        }
    }
}

TEST(ExrReader, AttributesAsText) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart part = every_type();
    part.edit = [](Imf::Header& h) {
        h.insert("comment", Imf::StringAttribute("hello"));
        Imf::addAperture(h, 2.8f);
        Imf::addFocus(h, 4.1234567f);
        Imf::addFramesPerSecond(h, Imf::Rational(24000, 1001));
        Imf::addMultiView(h, {"left", "right"});
        Imf::addTimeCode(h, Imf::TimeCode(1, 2, 3, 4));
        Imf::addChromaticities(h, Imf::Chromaticities());
    };
    write_file(path, {part});
    const ExrFile file = must(ExrFile::open(path));
    const ExrPart& p = file.parts()[0];
    EXPECT_EQ(p.attributes.at("comment"), "hello");
    EXPECT_EQ(p.attributes.at("aperture"), "2.8");
    EXPECT_EQ(std::stof(p.attributes.at("focus")), 4.1234567f);
    EXPECT_EQ(p.attributes.at("framesPerSecond"), "24000/1001");
    EXPECT_EQ(p.attributes.at("timeCode"), "01:02:03:04");
    EXPECT_EQ(p.attributes.at("compression"), "zip");
    EXPECT_EQ(p.attributes.at("dataWindow"), "(0, 0)-(12, 8)");
    EXPECT_EQ(p.attributes.at("multiView"), "left, right");
    EXPECT_THAT(p.views, ElementsAre("left", "right"));
    ASSERT_TRUE(p.chromaticities.has_value());
    EXPECT_EQ((*p.chromaticities)[0], 0.64f);
}

}  // namespace
}  // namespace postchain::io::test_exr_reader
