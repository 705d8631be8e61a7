#include <ImfChromaticities.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTimeCodeAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <fcntl.h>
#include <bit>
#include <cstring>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_internal.h"

namespace postchain::io::test_exr_reader {
namespace {

using test::FilePart;
using test::must;
using test::sample_value;
using test::write_file;
using testing::ElementsAre;

using ExrReader = InOut;

FilePart every_type() {
    return {.channels = {{"A"}, {"B"}, {"G"}, {"R"}, {"Z", Imf::FLOAT}, {"id", Imf::UINT}},
            .special_values = true};
}

// A file that is read can be copied or rendered again; one that is written cannot.
TEST(ExrExceptions, HaveARemedyForInput) {
    const auto said = [](StatusCode code, const std::exception& fault) {
        try {
            if (dynamic_cast<const std::bad_alloc*>(&fault)) throw std::bad_alloc();
            throw std::runtime_error(fault.what());
        } catch (...) {
            return status_of_exr_exception(code, "a.exr", "bad: ");
        }
    };
    const std::runtime_error two_lines("one\ntwo");
    EXPECT_EQ(said(StatusCode::input, two_lines).message(),
              "a.exr: bad: one two; copy or render it again");
    EXPECT_EQ(said(StatusCode::output, two_lines).message(), "a.exr: bad: one two");
    EXPECT_EQ(said(StatusCode::output, two_lines).code(), StatusCode::output);
    EXPECT_EQ(said(StatusCode::input, std::bad_alloc()).code(), StatusCode::memory);
    EXPECT_EQ(said(StatusCode::input, std::runtime_error("std::bad_alloc")).code(),
              StatusCode::memory);
}

TEST_F(ExrReader, LevelZeroOfEachKindOfLevels) {
    FilePart part = every_type();
    part.tile = 4;
    part.line_order = Imf::DECREASING_Y;
    for (const auto levels : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS}) {
        SCOPED_TRACE(concat("levels ", int(levels)));
        part.levels = levels;
        write_file(in, {part});
        expect_samples(in, 0, part);
        EXPECT_EQ(must(ExrFile::open(in)).parts()[0].mip_mapped, levels != Imf::ONE_LEVEL);
    }
}

TEST_F(ExrReader, PartsViewsTypesAndWindows) {
    FilePart left = every_type();
    left.name = "rgba.left";
    left.data = {{-4, -6}, {10, 12}};
    left.display = {{0, 0}, {99, 49}};
    left.edit = [](Imf::Header& h) {
        h.setView("left");
        h.pixelAspectRatio() = 2;
    };
    FilePart depth{.name = "depth", .channels = {{"Z", Imf::FLOAT}}, .tile = 4};
    FilePart deep{.name = "deep", .channels = {{"Z", Imf::FLOAT}}, .deep = true};
    deep.compression = Imf::ZIPS_COMPRESSION;
    depth.display = deep.display = left.display;
    depth.edit = deep.edit = [](Imf::Header& h) { h.pixelAspectRatio() = 2; };
    write_file(in, {left, depth, deep});
    const ExrFile file = must(ExrFile::open(in));
    ASSERT_EQ(file.parts().size(), 3u);
    const ExrPart& first = file.parts()[0];
    EXPECT_EQ(first.name, "rgba.left");
    EXPECT_EQ(first.view, "left");
    EXPECT_EQ(first.type, "scanlineimage");
    EXPECT_EQ(first.data_window, (Window{-4, -6, 10, 12}));
    EXPECT_EQ(first.display_window, (Window{0, 0, 99, 49}));
    EXPECT_EQ(first.pixel_aspect, 2);
    EXPECT_EQ(first.find("id")->type, PixelType::uint32);
    EXPECT_EQ(first.find("none"), nullptr);
    EXPECT_EQ(file.parts()[1].type, "tiledimage");
    EXPECT_EQ(file.parts()[2].type, "deepscanline");
    EXPECT_TRUE(file.parts()[2].deep);
    expect_samples(in, 0, left);
    expect_samples(in, 1, depth);
}

// OpenEXR's reader asks for few bytes and for whole chunks, in any order.
TEST_F(ExrReader, BytesOfItsStreamAreThoseOfTheFile) {
    std::string text;
    while (text.size() < 1'000'000) text += concat(text.size(), " ");
    test::write_text(in, text);
    FdIStream stream(in);
    stream.take(::open(in.c_str(), O_RDONLY), text.size());
    for (const auto& [at, count] : {std::pair(500'000, 9),
                                    {500'100, 9},
                                    {400'000, 9},
                                    {3, 700'000},
                                    {500'090, 300'000},
                                    {0, 1}}) {
        std::string read(size_t(count), '?');
        stream.seekg(uint64_t(at));
        EXPECT_TRUE(stream.read(read.data(), count));
        EXPECT_TRUE(read == text.substr(size_t(at), size_t(count))) << at;
        EXPECT_EQ(stream.tellg(), uint64_t(at + count));
    }
    stream.seekg(text.size() - 3);
    char end[4];
    EXPECT_FALSE(stream.read(end, 3)) << "nothing follows";
    for (const uint64_t at : {uint64_t(text.size() - 3), uint64_t(1) << 40}) {
        stream.seekg(at);
        EXPECT_THROW(stream.read(end, 4), std::runtime_error);
    }
}

TEST_F(ExrReader, ReadsOnlyTheChannelsAskedFor) {
    FilePart part = every_type();
    part.special_values = false;
    part.data = {{-2, -3}, {9, 8}};
    write_file(in, {part});
    ExrFile file = must(ExrFile::open(in));
    EXPECT_EQ(must(file.read_part(0, {"Z", "R"})).planes.size(), 2u);
    // In the order of the names; the file's order is alphabetical.
    const auto image = must(file.read_channels(0, {"Z", "R", "id"}));
    constexpr size_t kStored[] = {4, 3, 5};
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < 3; ++c)
                ASSERT_EQ(image.at(x, y, c), sample_value(part, kStored[c], x - 2, y - 3));
    EXPECT_FALSE(file.read_channels(0, {"Q"}).ok());
    EXPECT_FALSE(file.read_part(0, {"R", "Q"}).ok());
    for (const int no_part : {1, -1}) EXPECT_FALSE(file.read_part(no_part).ok());
    // A window of them, with a value for channels that are not there.
    const ImageF crop = must(file.read_part(0)).interleaved({"R"}, {1, 2, 3, 5}, 4, 7);
    EXPECT_EQ(crop.width, 3);
    EXPECT_EQ(crop.height, 4);
    EXPECT_EQ(crop.at(0, 0, 0), sample_value(part, 3, 1, 2));
    EXPECT_EQ(crop.at(2, 3, 0), sample_value(part, 3, 3, 5));
    EXPECT_EQ(crop.at(2, 3, 1), 7);
    EXPECT_EQ(crop.at(2, 3, 3), 7);
    // A data window apart from the part's.
    const PartPixels far = must(file.read_part(0)).placed({50, 0, 52, 1}, {{"Z", 7}});
    EXPECT_EQ(far.interleaved({"R", "Z"}, far.window).data,
              (std::vector<float>{0, 7, 0, 7, 0, 7, 0, 7, 0, 7, 0, 7}));
}

// All 65536 patterns, against Imath's table.
TEST_F(ExrReader, AllHalvesBecomeTheirFloats) {
    FilePart part{.channels = {{"id", Imf::UINT}}};
    part.data = part.display = {{0, 0}, {255, 255}};
    write_file(in, {part});
    ExrFile file = must(ExrFile::open(in));
    auto pixels = must(file.read_part(0));
    PartPixels::Plane& plane = pixels.planes[0];
    plane.channel.type = PixelType::half;
    for (uint32_t i = 0; i < 65536; ++i) {
        const auto bits = uint16_t(i);
        std::memcpy(plane.bytes.get() + i * 2, &bits, 2);
    }
    const ImageF image = pixels.interleaved({"id"}, pixels.window);
    for (uint32_t i = 0; i < 65536; ++i) {
        const float expected = half(half::FromBits, uint16_t(i));
        if (std::isnan(expected))
            ASSERT_TRUE(std::isnan(image.data[i])) << i;
        else
            ASSERT_EQ(std::bit_cast<uint32_t>(image.data[i]), std::bit_cast<uint32_t>(expected));
    }
}

TEST_F(ExrReader, AttributesAsText) {
    FilePart part = every_type();
    part.edit = [](Imf::Header& h) {
        h.insert("comment", Imf::StringAttribute("hello"));
        Imf::addAperture(h, 2.8f);
        Imf::addFocus(h, 4.1234567f);
        Imf::addFramesPerSecond(h, Imf::Rational(24000, 1001));
        Imf::addMultiView(h, {"left", "right"});
        Imf::addTimeCode(h, Imf::TimeCode(1, 2, 3, 4));
        h.insert("drop", Imf::TimeCodeAttribute(Imf::TimeCode(10, 20, 30, 9, true)));
        Imf::addChromaticities(h, Imf::Chromaticities());
    };
    write_file(in, {part});
    const ExrFile file = must(ExrFile::open(in));
    const ExrPart& p = file.parts()[0];
    for (const auto& [name, text] : {std::pair("comment", "hello"),
                                     {"aperture", "2.8"},
                                     {"framesPerSecond", "24000/1001"},
                                     {"timeCode", "01:02:03:04"},
                                     {"drop", "10:20:30;09"},
                                     {"compression", "zip"},
                                     {"dataWindow", "(0, 0)-(12, 8)"},
                                     {"multiView", "left, right"}})
        EXPECT_EQ(p.attributes.at(name), text);
    EXPECT_EQ(std::stof(p.attributes.at("focus")), 4.1234567f);
    EXPECT_THAT(p.views, ElementsAre("left", "right"));
    ASSERT_TRUE(p.chromaticities.has_value());
    EXPECT_EQ((*p.chromaticities)[0], 0.64f);
}

}  // namespace
}  // namespace postchain::io::test_exr_reader
