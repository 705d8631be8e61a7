// Content that write_filtered() keeps, replaces and refuses. Inputs are written with OpenEXR;
// outputs are read with OpenImageIO, which shares no code with tools/sequence.
#include <ImfPreviewImage.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <cstring>
#include <limits>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/frame/frame_writer.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::named;
using test::oiio_attributes;
using test::oiio_channels;
using test::OiioChannel;
using test::write_file;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Layout {
    Imf::Compression compression;
    int tile;
    Imf::LineOrder order;
};

TEST_F(ExrWriter, OnlyColorAndTheNewAttributeChange) {
    for (const auto& [compression, tile, order] :
         {Layout{Imf::RLE_COMPRESSION, 0, Imf::DECREASING_Y},
          Layout{Imf::ZIP_COMPRESSION, 0, Imf::INCREASING_Y},
          Layout{Imf::PIZ_COMPRESSION, 0, Imf::INCREASING_Y},
          Layout{Imf::PIZ_COMPRESSION, 7, Imf::DECREASING_Y},
          Layout{Imf::NO_COMPRESSION, 64, Imf::RANDOM_Y}}) {
        SCOPED_TRACE(concat("compression ", int(compression), ", tile ", tile));
        FilePart part = every_type();
        part.compression = compression;
        part.tile = tile;
        part.line_order = order;
        const auto report = expect_new_color({part}, {.attributes = {{"postchain", "1 ab"}}});
        EXPECT_THAT(attribute_changes(in, out), ElementsAre("+ postchain = 1 ab"));
        EXPECT_THAT(report.notes, IsEmpty());
        EXPECT_EQ(report.bytes, test::read_text(out).size());
        EXPECT_FALSE(report.skipped);
        // OpenImageIO reports neither line order nor type, so they are read with OpenEXR.
        auto attributes = must(ExrFile::open(out)).parts()[0].attributes;
        EXPECT_EQ(attributes.erase("postchain"), 1u);
        EXPECT_EQ(attributes, must(ExrFile::open(in)).parts()[0].attributes);
    }
}

bool has_type_attribute(const std::string& path) {
    return test::read_text(path).find(std::string("type\0string\0", 12)) != std::string::npos;
}

// OpenEXR's multi-part classes always have a type; in the file it is optional.
TEST_F(ExrWriter, ASinglePartGetsNoTypeItDidNotHave) {
    ASSERT_TRUE(write_planes_exr(in, ImageF(4, 3, 4, 1), kRgba).ok());
    InputFrame frame = read_ok(in);
    write_ok(out, frame, new_color(frame));
    EXPECT_FALSE(has_type_attribute(in));
    EXPECT_FALSE(has_type_attribute(out));
    expect_new_color({every_type()});
    EXPECT_TRUE(has_type_attribute(in));
    EXPECT_TRUE(has_type_attribute(out));
}

TEST_F(ExrWriter, EveryOtherPartStaysBitForBit) {
    // A lossy part, a mip-mapped, a rip-mapped and two deep parts around color's.
    FilePart lossy{.name = "lossy",
                   .channels = {{"R"}, {"G"}, {"B"}},
                   .data = {{-7, -3}, {40, 41}},
                   .compression = Imf::DWAA_COMPRESSION};
    FilePart mip{.name = "mip", .channels = {{"Z", Imf::FLOAT}}, .tile = 4};
    mip.levels = Imf::MIPMAP_LEVELS;
    FilePart rip = mip;
    rip.name = "rip";
    rip.levels = Imf::RIPMAP_LEVELS;
    FilePart deep{.name = "deep",
                  .channels = {{"A", Imf::FLOAT}, {"Z", Imf::FLOAT}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    FilePart deep_tiles = deep;
    deep_tiles.name = "deep_tiles";
    deep_tiles.tile = 8;
    std::vector<FilePart> parts = {lossy, every_type("beauty"), mip, rip, deep, deep_tiles};
    for (FilePart& part : parts) {  // attributes that all parts of a file share
        part.display = parts[1].display;
        part.edit = parts[1].edit;
    }
    const auto report = expect_new_color(parts, {.attributes = {{"postchain", "x"}}}, 1);
    EXPECT_THAT(report.notes, IsEmpty());
    ASSERT_EQ(test::oiio_parts(out), int(parts.size()));
    EXPECT_THAT(attribute_changes(in, out, 1), ElementsAre("+ postchain = x"));
    for (const int part : {0, 2, 3, 4, 5}) {
        EXPECT_THAT(attribute_changes(in, out, part), IsEmpty());
        if (parts[size_t(part)].deep) {
            EXPECT_EQ(test::oiio_deep(in, part), test::oiio_deep(out, part));
        } else {
            EXPECT_TRUE(oiio_channels(in, part) == oiio_channels(out, part)) << part;
        }
    }
    for (const int level : {1, 2})
        EXPECT_TRUE(oiio_channels(in, 2, level) == oiio_channels(out, 2, level)) << level;
    // The compressed bytes of the lossy part are unchanged.
    const std::string before = test::read_text(in), after = test::read_text(out);
    int common = 0;
    for (size_t at = 0; at + 64 <= before.size(); at += 64)
        common += after.find(before.substr(at, 64)) != std::string::npos;
    EXPECT_GT(common, 10);
}

TEST_F(ExrWriter, TheOtherViewStays) {
    const std::vector<std::string> rgb = {"R", "G", "B"},
                                   right_rgb = {"right.R", "right.G", "right.B"};
    FilePart part{.channels = {{"R"}, {"G"}, {"B"}, {"right.R"}, {"right.G"}, {"right.B"}}};
    part.edit = [](Imf::Header& h) { Imf::addMultiView(h, {"left", "right"}); };
    for (const auto& names : {rgb, right_rgb}) {
        expect_new_color({part}, {}, 0, names);
        EXPECT_THAT(attribute_changes(in, out), IsEmpty());
    }
    FilePart left{.name = "rgb.left", .channels = {{"R"}, {"G"}, {"B"}}}, right = left;
    left.edit = [](Imf::Header& h) { h.setView("left"); };
    right.name = "rgb.right";
    right.edit = [](Imf::Header& h) { h.setView("right"); };
    expect_new_color({left, right}, {}, 1, rgb);
    EXPECT_TRUE(oiio_channels(in, 0) == oiio_channels(out, 0));
    EXPECT_THAT(attribute_changes(in, out, 1), IsEmpty());
}

TEST_F(ExrWriter, MetadataThatIsNoLongerTrueIsLeftOut) {
    FilePart part = every_type();
    part.edit = [](Imf::Header& h) {
        h.setPreviewImage(Imf::PreviewImage(2, 2));
        h.insert("oiio:SHA-1", Imf::StringAttribute("0123"));
        h.insert("comment", Imf::StringAttribute("kept"));
    };
    EXPECT_THAT(expect_new_color({part}).notes,
                ElementsAre(HasSubstr("preview"), HasSubstr("oiio:SHA-1")));
    const auto attributes = must(ExrFile::open(out)).parts()[0].attributes;
    EXPECT_FALSE(attributes.contains("preview"));
    EXPECT_FALSE(attributes.contains("oiio:SHA-1"));
    EXPECT_TRUE(attributes.contains("comment"));
}

TEST_F(ExrWriter, AMipMappedColorPartKeepsItsFullSizeLevel) {
    FilePart part = every_type();
    part.tile = 8;
    part.levels = Imf::MIPMAP_LEVELS;
    EXPECT_THAT(expect_new_color({part}).notes, ElementsAre(HasSubstr("smaller levels")));
    EXPECT_FALSE(ExrFile::open(out)->parts()[0].mip_mapped);
}

TEST_F(ExrWriter, ADamagedPartThatWouldBeCopiedIsAnError) {
    write_file(in, {{.name = "a", .channels = {{"R"}, {"G"}, {"B"}, {"A"}}},
                    {.name = "b", .channels = {{"X", Imf::FLOAT}}}});
    const std::string whole = test::read_text(in);
    test::write_text(in, whole.substr(0, whole.size() - 3));
    InputFrame frame = read_ok(in);
    EXPECT_FALSE(write_filtered(out, frame, new_color(frame), {}).ok());
    EXPECT_THAT(folder.names(), ElementsAre("in.exr"));
}

TEST(PlanesWriter, TypesAttributesAndWindows) {
    const test::TempFolder folder;
    const std::string path = folder.path("f.exr");
    ImageF color(5, 3, 4);
    ImageF depth(5, 3, 1, 2.5f);
    for (size_t i = 0; i < color.data.size(); ++i) color.data[i] = float(i) / 8;
    PlanesFile file;
    file.channels = {{"ViewLayer.Combined.R", PixelType::half, &color, 0},
                     {"ViewLayer.Combined.A", PixelType::half, &color, 3},
                     {"ViewLayer.Depth.Z", PixelType::float32, &depth, 0},
                     {"id", PixelType::uint32, &color, 1}};
    file.attributes = {{"comment", "text"}, {"aperture", 2.8f}, {"frame", 7}};
    file.origin_x = -1;
    file.origin_y = 2;
    file.display_window = Window{0, 0, 9, 9};
    const auto report = must(write_planes_exr(path, file));
    const auto channels = oiio_channels(path);
    ASSERT_EQ(channels.size(), 4u);
    EXPECT_EQ(named(channels, "ViewLayer.Combined.R").type, "half");
    EXPECT_EQ(named(channels, "ViewLayer.Depth.Z").type, "float");
    EXPECT_EQ(named(channels, "id").type, "uint");
    const OiioChannel alpha = named(channels, "ViewLayer.Combined.A");
    for (size_t p = 0; p < color.pixels(); ++p) {
        half h;
        std::memcpy(&h, alpha.bytes.data() + p * 2, 2);
        EXPECT_EQ(float(h), color.data[p * 4 + 3]);
    }
    const auto attributes = oiio_attributes(path);
    EXPECT_THAT(attributes, testing::Contains("windows = -1 2 5 3 of 0 0 10 10 tile 0 0"));
    EXPECT_THAT(attributes, testing::Contains("frame = 7"));
    const auto back = must(ExrFile::open(path));
    EXPECT_EQ(back.parts()[0].attributes.at("comment"), "text");
    EXPECT_EQ(back.parts()[0].attributes.at("aperture"), "2.8");
}

TEST(PlanesWriter, AWholeImageAsFloat) {
    const test::TempFolder folder;
    ImageF image(3, 2, 2);
    image.data = {1, 2, 3, 4, 5, 6, 7, 8, 9, 1e30f, std::numeric_limits<float>::infinity(), 12};
    const auto report = must(write_planes_exr(folder.path("f.exr"), image, {"x", "y"}));
    EXPECT_EQ(report.nonfinite_pixels, 1u);
    const auto back = must(ExrFile::open(folder.path("f.exr"))->read_channels(0, {"x", "y"}));
    EXPECT_TRUE(back == image);
}

TEST(PlanesWriter, SizesThatDifferAreADefectOfTheCaller) {
    const test::TempFolder folder;
    const ImageF a(3, 2, 1), b(3, 3, 1);
    PlanesFile sizes, channel;
    sizes.channels = {{"a", PixelType::half, &a, 0}, {"b", PixelType::half, &b, 0}};
    channel.channels = {{"a", PixelType::half, &a, 1}};
    for (const PlanesFile& file : {sizes, channel, PlanesFile()})
        EXPECT_EQ(write_planes_exr(folder.path("f"), file).status().code(), StatusCode::internal);
    EXPECT_THAT(folder.names(), IsEmpty());
}

}  // namespace
}  // namespace postchain::io
