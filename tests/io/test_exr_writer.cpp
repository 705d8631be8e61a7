// Content that write_filtered() keeps, replaces and refuses. Inputs are written with OpenEXR;
// outputs are read with OpenImageIO, which shares no code with tools/sequence.
#include <ImfPreviewImage.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/frame/frame_writer.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::oiio_channels;
using test::TempFolder;
using test::write_file;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Layout {
    Imf::Compression compression;
    int tile;
    Imf::LineOrder order;
};

class Layouts : public testing::TestWithParam<Layout> {};

TEST_P(Layouts, OnlyColorAndTheNewAttributeChange) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    const std::string out = folder.path("out.exr");
    FilePart part = every_type();
    part.compression = GetParam().compression;
    part.tile = GetParam().tile;
    part.line_order = GetParam().order;
    write_file(in, {part});
    InputFrame frame = read_ok(in);
    const ImageF color = new_color(frame);
    const WriteReport report = write_ok(out, frame, color, {.attributes = {{"postchain", "1 ab"}}});
    expect_only_color_changed(in, out, 0, kRgba, color);
    EXPECT_THAT(attribute_changes(in, out), ElementsAre("+ postchain = 1 ab"));
    EXPECT_THAT(report.notes, IsEmpty());
    EXPECT_EQ(report.bytes, test::read_text(out).size());
    EXPECT_FALSE(report.skipped);
    // OpenImageIO reports neither line order nor type, so they are read with OpenEXR.
    const auto before = must(ExrFile::open(in));
    const auto after = must(ExrFile::open(out));
    auto attributes = after.parts()[0].attributes;
    EXPECT_EQ(attributes.erase("postchain"), 1u);
    EXPECT_EQ(attributes, before.parts()[0].attributes);
}

INSTANTIATE_TEST_SUITE_P(EveryLosslessOne, Layouts,
                         testing::Values(Layout{Imf::NO_COMPRESSION, 0, Imf::INCREASING_Y},
                                         Layout{Imf::RLE_COMPRESSION, 0, Imf::DECREASING_Y},
                                         Layout{Imf::ZIPS_COMPRESSION, 0, Imf::INCREASING_Y},
                                         Layout{Imf::ZIP_COMPRESSION, 0, Imf::DECREASING_Y},
                                         Layout{Imf::ZIP_COMPRESSION, 0, Imf::INCREASING_Y},
                                         Layout{Imf::PIZ_COMPRESSION, 0, Imf::INCREASING_Y},
                                         Layout{Imf::ZIP_COMPRESSION, 8, Imf::INCREASING_Y},
                                         Layout{Imf::PIZ_COMPRESSION, 7, Imf::DECREASING_Y},
                                         Layout{Imf::NO_COMPRESSION, 64, Imf::RANDOM_Y}));

bool has_type_attribute(const std::string& path) {
    return test::read_text(path).find(std::string("type\0string\0", 12)) != std::string::npos;
}

TEST(ExrWriter, ASinglePartGetsNoTypeItDidNotHave) {
    // OpenEXR's multi-part classes always have a type; in the file it is optional.
    const TempFolder folder;
    const ImageF image(4, 3, 4, 1);
    ASSERT_TRUE(write_planes_exr(folder.path("without.exr"), image, kRgba).ok());
    FilePart part = every_type();
    write_file(folder.path("with.exr"), {part});
    for (const std::string name : {"without.exr", "with.exr"}) {
        InputFrame frame = read_ok(folder.path(name));
        write_ok(folder.path("out." + name), frame, new_color(frame));
        EXPECT_EQ(has_type_attribute(folder.path(name)), name == "with.exr");
        EXPECT_EQ(has_type_attribute(folder.path("out." + name)), name == "with.exr");
    }
}

TEST(ExrWriter, FloatColorAndNoAlpha) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    const std::string out = folder.path("out.exr");
    FilePart part{.channels = {{"R", Imf::FLOAT}, {"G"}, {"B", Imf::FLOAT}}};
    write_file(in, {part});
    InputFrame frame = read_ok(in, 0, {"R", "G", "B"});
    ImageF color = new_color(frame);
    color.at(3, 2, 0) = 1e20f;  // fits float
    write_ok(out, frame, color);
    expect_only_color_changed(in, out, 0, {"R", "G", "B"}, color);
}

TEST(ExrWriter, EveryOtherPartStaysBitForBit) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    const std::string out = folder.path("out.exr");
    // A lossy part, a mip-mapped, a rip-mapped and two deep parts around color's.
    FilePart lossy{.name = "lossy",
                   .channels = {{"R"}, {"G"}, {"B"}},
                   .data = {{-7, -3}, {40, 41}},
                   .compression = Imf::DWAA_COMPRESSION};
    FilePart color = every_type("beauty");
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
    std::vector<FilePart> parts = {lossy, color, mip, rip, deep, deep_tiles};
    for (FilePart& part : parts) {  // attributes that all parts of a file share
        part.display = color.display;
        part.edit = color.edit;
    }
    write_file(in, parts);
    InputFrame frame = read_ok(in, 1);
    const ImageF filtered = new_color(frame);
    const WriteReport report = write_ok(out, frame, filtered, {.attributes = {{"postchain", "x"}}});
    EXPECT_THAT(report.notes, IsEmpty());
    ASSERT_EQ(test::oiio_parts(out), int(parts.size()));
    expect_only_color_changed(in, out, 1, kRgba, filtered);
    for (int part = 0; part < int(parts.size()); ++part) {
        if (part == 1) {
            EXPECT_THAT(attribute_changes(in, out, part), ElementsAre("+ postchain = x"));
            continue;
        }
        EXPECT_THAT(attribute_changes(in, out, part), IsEmpty());
        if (parts[size_t(part)].deep) {
            EXPECT_EQ(test::oiio_deep(in, part), test::oiio_deep(out, part));
        } else {
            EXPECT_TRUE(oiio_channels(in, part) == oiio_channels(out, part)) << part;
        }
    }
    for (const int level : {1, 2}) {
        EXPECT_TRUE(oiio_channels(in, 2, level) == oiio_channels(out, 2, level)) << level;
    }
    // The compressed bytes of the lossy part are unchanged.
    const std::string a = test::read_text(in);
    const std::string b = test::read_text(out);
    int common = 0;
    for (size_t at = 0; at + 64 <= a.size(); at += 64) {
        common += b.find(a.substr(at, 64)) != std::string::npos;
    }
    EXPECT_GT(common, 10);
}

TEST(ExrWriter, TheOtherViewStays) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    const std::string out = folder.path("out.exr");
    FilePart part{.channels = {{"R"}, {"G"}, {"B"}, {"right.R"}, {"right.G"}, {"right.B"}},
                  .edit = [](Imf::Header& h) {
                      Imf::addMultiView(h, {"left", "right"});
                  }};
    write_file(in, {part});
    for (const std::vector<std::string>& names :
         {std::vector<std::string>{"R", "G", "B"}, {"right.R", "right.G", "right.B"}}) {
        InputFrame frame = read_ok(in, 0, names);
        const ImageF color = new_color(frame);
        write_ok(out, frame, color, {.on_existing = OnExisting::overwrite});
        expect_only_color_changed(in, out, 0, names, color);
        EXPECT_THAT(attribute_changes(in, out), IsEmpty());
    }
    // Two parts, one per view.
    FilePart left{.name = "rgb.left",
                  .channels = {{"R"}, {"G"}, {"B"}},
                  .edit = [](Imf::Header& h) { h.setView("left"); }};
    FilePart right = left;
    right.name = "rgb.right";
    right.edit = [](Imf::Header& h) { h.setView("right"); };
    write_file(in, {left, right});
    InputFrame frame = read_ok(in, 1, {"R", "G", "B"});
    const ImageF color = new_color(frame);
    write_ok(out, frame, color, {.on_existing = OnExisting::overwrite});
    expect_only_color_changed(in, out, 1, {"R", "G", "B"}, color);
    EXPECT_TRUE(oiio_channels(in, 0) == oiio_channels(out, 0));
    EXPECT_THAT(attribute_changes(in, out, 1), IsEmpty());
}

TEST(ExrWriter, MetadataThatIsNoLongerTrueIsLeftOut) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    const std::string out = folder.path("out.exr");
    FilePart part = every_type();
    part.edit = [](Imf::Header& h) {
        h.setPreviewImage(Imf::PreviewImage(2, 2));
        h.insert("oiio:SHA-1", Imf::StringAttribute("0123"));
        h.insert("comment", Imf::StringAttribute("kept"));
    };
    write_file(in, {part});
    InputFrame frame = read_ok(in);
    const WriteReport report = write_ok(out, frame, new_color(frame));
    EXPECT_THAT(report.notes, ElementsAre(HasSubstr("preview"), HasSubstr("oiio:SHA-1")));
    const auto file = must(ExrFile::open(out));
    EXPECT_FALSE(file.parts()[0].attributes.contains("preview"));
    EXPECT_FALSE(file.parts()[0].attributes.contains("oiio:SHA-1"));
    EXPECT_TRUE(file.parts()[0].attributes.contains("comment"));
}

TEST(ExrWriter, AMipMappedColorPartKeepsItsFullSizeLevel) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    const std::string out = folder.path("out.exr");
    FilePart part = every_type();
    part.tile = 8;
    part.levels = Imf::MIPMAP_LEVELS;
    write_file(in, {part});
    InputFrame frame = read_ok(in);
    const ImageF color = new_color(frame);
    const WriteReport report = write_ok(out, frame, color);
    EXPECT_THAT(report.notes, ElementsAre(HasSubstr("smaller levels")));
    expect_only_color_changed(in, out, 0, kRgba, color);
    EXPECT_FALSE(ExrFile::open(out)->parts()[0].mip_mapped);
}

TEST(ExrWriter, ColorFromAFileOfItsOwn) {
    const TempFolder folder;
    FilePart color_part{.channels = {{"R"}, {"G"}, {"B"}, {"A"}}};
    FilePart depth_part{.channels = {{"Z", Imf::FLOAT}}};
    write_file(folder.path("c.exr"), {color_part});
    write_file(folder.path("d.exr"), {depth_part});
    auto open = must(open_frame(
        {{Role::color, folder.path("c.exr")}, {Role::inverse_depth, folder.path("d.exr")}}, 1));
    Result<InputFrame> frame =
        read_frame(open, {{Role::color, {0, kRgba}}, {Role::inverse_depth, {0, {"Z"}}}},
                   {Role::color, Role::inverse_depth}, Keep::all);
    ASSERT_TRUE(frame.ok()) << frame.status().message();
    const ImageF color = new_color(*frame);
    write_ok(folder.path("out.exr"), *frame, color);
    expect_only_color_changed(folder.path("c.exr"), folder.path("out.exr"), 0, kRgba, color);
}

TEST(ExrWriter, ADamagedPartThatWouldBeCopiedIsAnError) {
    const TempFolder folder;
    const std::string in = folder.path("in.exr");
    FilePart beauty{.name = "a", .channels = {{"R"}, {"G"}, {"B"}, {"A"}}};
    FilePart other{.name = "b", .channels = {{"X", Imf::FLOAT}}};
    write_file(in, {beauty, other});
    const std::string whole = test::read_text(in);
    test::write_text(in, whole.substr(0, whole.size() - 3));
    InputFrame frame = read_ok(in);
    const Result<WriteReport> report =
        write_filtered(folder.path("out.exr"), frame, new_color(frame), {});
    ASSERT_FALSE(report.ok());
    EXPECT_THAT(folder.names(), ElementsAre("in.exr"));
}

}  // namespace
}  // namespace postchain::io
