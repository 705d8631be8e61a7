// Content that write_filtered() keeps, replaces and refuses; colors out of range, rounded and
// compressed. Inputs are written with OpenEXR; outputs are read with OpenImageIO, which shares no
// code with tools/sequence.
#include <ImfPreviewImage.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <limits>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/pixel_encode.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/planes/frame_writer.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::named;
using test::oiio_attributes;
using test::oiio_channels;
using test::OiioChannel;
using test::read_text;
using test::write_file;
using testing::AllOf;
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
        EXPECT_EQ(report.bytes, read_text(out).size());
        // OpenImageIO reports neither line order nor type, so they are read with OpenEXR.
        auto attributes = must(ExrFile::open(out)).parts()[0].attributes;
        EXPECT_EQ(attributes.erase("postchain"), 1u);
        EXPECT_EQ(attributes, must(ExrFile::open(in)).parts()[0].attributes);
    }
}

bool has_type_attribute(const std::string& path) {
    return read_text(path).find(std::string("type\0string\0", 12)) != std::string::npos;
}

// OpenEXR's multi-part classes always have a type; in the file it is optional.
TEST_F(ExrWriter, ASinglePartGetsNoTypeItDidNotHave) {
    ASSERT_TRUE(write_planes_exr(in, ImageF(4, 3, 4, 1), kRgba).ok());
    ReadFile frame = read_ok(in);
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
    ASSERT_EQ(must(ExrFile::open(out)).parts().size(), parts.size());
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
    const std::string before = read_text(in), after = read_text(out);
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
    right.tile = 8;
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
    const std::string whole = read_text(in);
    test::write_text(in, whole.substr(0, whole.size() - 3));
    ReadFile frame = read_ok(in);
    EXPECT_FALSE(write_filtered(out, frame, new_color(frame), {}).ok());
    EXPECT_THAT(folder.names(), ElementsAre("in.exr"));
}

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kMost = std::numeric_limits<float>::max();

struct Replaced {
    int x, y, channel;
    float given, written;
};

struct Overflow {
    Imf::PixelType type;
    std::vector<Replaced> samples;
    uint64_t finite, nonfinite;  // pixels that do not fit
    std::string remedy;
};

TEST_F(ExrWriter, ColorThatDoesNotFitIsRefusedOrClampedNeverInf) {
    const std::vector<Replaced> halves = {{1, 0, 0, 65505, 65504},
                                          {1, 0, 1, 1e6f, 65504},  // the same pixel
                                          {2, 5, 2, -70000, -65504},
                                          {3, 5, 2, 65504, 65504},  // fits
                                          {4, 4, 0, kInf, 65504},
                                          {5, 4, 3, kNan, 0}},
                                floats = {{0, 0, 0, kMost, kMost},  // fits
                                          {1, 0, 0, kInf, kMost},
                                          {1, 0, 1, -kInf, -kMost},  // the same pixel
                                          {2, 5, 2, kNan, 0}};
    for (const Overflow& one : {Overflow{Imf::HALF, halves, 2, 2, "or render color as float"},
                                Overflow{Imf::FLOAT, floats, 0, 2, "{overflow=clamp}"_keyed}}) {
        FilePart part = every_type();
        for (size_t c = 0; c < 4; ++c) part.channels[c].type = one.type;
        write_file(in, {part});
        std::filesystem::remove(out);
        ReadFile frame = read_ok(in);
        ImageF color = new_color(frame), expected = color;
        for (const Replaced& sample : one.samples) {
            color.at(sample.x, sample.y, sample.channel) = sample.given;
            expected.at(sample.x, sample.y, sample.channel) = sample.written;
        }
        const Status refused = write_filtered(out, frame, color, {}).status();
        EXPECT_EQ(refused.code(), StatusCode::output);
        EXPECT_THAT(
            refused.message(),
            AllOf(HasSubstr(concat(one.finite + one.nonfinite, " pixels")), HasSubstr(one.remedy)));
        EXPECT_THAT(folder.names(), ElementsAre("in.exr"));
        const WriteReport report = write_ok(out, frame, color, {.overflow = HalfOverflow::clamp});
        EXPECT_EQ(report.overflow_pixels, one.finite);
        EXPECT_EQ(report.nonfinite_pixels, one.nonfinite);
        expect_only_color_changed(in, out, 0, kRgba, expected);
    }
}

// A layer in a part of its own is refused like color.
TEST_F(ExrWriter, ALayerThatDoesNotFitIsRefusedWhereverItIs) {
    FilePart light{.name = "light", .channels = {{"A"}, {"B"}, {"G"}, {"R"}}};
    FilePart color = light;
    color.name = "color";
    for (FilePart* part : {&light, &color}) part->data = part->display = {{0, 0}, {12, 8}};
    for (const float value : {70000.f, -70000.f, kInf, kNan})
        for (const bool first : {false, true}) {
            write_file(in, first ? std::vector{light, color} : std::vector{color, light});
            ReadFile frame = read_ok(in, first ? 1 : 0);
            const ImageF same = new_color(frame);
            ImageF layer = same;
            layer.at(5, 3, 1) = value;
            const std::vector<FilteredLayer> layers = {
                {.part = first ? 0 : 1, .channels = kRgba, .image = &layer}};
            const auto refused = write_filtered(out, frame, same, {}, layers);
            EXPECT_THAT(test::error_of(refused), HasSubstr("1 pixels of color do not fit"));
        }
}

ImageF color_of(const std::string& path) {
    return must(must(ExrFile::open(path)).read_channels(0, kRgba));
}

// 2049 lies between the halves 2048 and 2050: to even. 2051 between 2050 and 2052: to 2052.
TEST_F(ExrWriter, RoundsToTheNearestHalf) {
    write_file(in, {every_type()});
    ReadFile frame = read_ok(in);
    ImageF color = new_color(frame);
    for (size_t i = 0; i < color.data.size(); ++i) color.data[i] = float(i % 2 == 0 ? 2049 : 2051);
    write_ok(out, frame, color);
    const ImageF back = color_of(out);
    for (size_t i = 0; i < back.data.size(); ++i)
        ASSERT_EQ(back.data[i], i % 2 == 0 ? 2048.0f : 2052.0f);
}

TEST_F(ExrWriter, IntegersAreRoundedIntoTheirRange) {
    ImageF values(6, 1, 1);
    values.data = {-3, 0.4f, 0.6f, 5e9f, kNan, kInf};
    std::vector<uint32_t> stored(6, 7);
    const EncodeCounts counts = encode_channels(
        {{&values, 0, PixelType::uint32, reinterpret_cast<std::byte*>(stored.data())}});
    constexpr uint32_t kLargest = std::numeric_limits<uint32_t>::max();
    EXPECT_THAT(stored, ElementsAre(0, 0, 1, kLargest, 0, kLargest));
    EXPECT_EQ(counts.nonfinite_pixels, 2u);
    EXPECT_EQ(counts.refused_pixels, 0u);
}

TEST_F(ExrWriter, LossyCompressionNeverTouchesOtherChannels) {
    for (const auto compression :
         {Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION,
          Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
        FilePart part = every_type();
        part.special_values = false;
        part.compression = compression;
        part.tile = compression == Imf::B44_COMPRESSION ? 16 : 0;
        EXPECT_THAT(expect_new_color({part}).notes, ElementsAre(HasSubstr("replaced by zip")));
        EXPECT_EQ(ExrFile::open(out)->parts()[0].compression, "zip");
    }
    // Color alone keeps it.
    write_file(in, {{.channels = {{"R"}, {"G"}, {"B"}, {"A"}},
                     .data = {{0, 0}, {63, 63}},
                     .compression = Imf::DWAA_COMPRESSION}});
    ReadFile frame = read_ok(in);
    const WriteOptions overwrite{.on_existing = OnExisting::overwrite};
    EXPECT_THAT(write_ok(out, frame, ImageF(64, 64, 4, 0.5f), overwrite).notes, IsEmpty());
    EXPECT_EQ(ExrFile::open(out)->parts()[0].compression, "dwaa");
    for (const float v : color_of(out).data) EXPECT_NEAR(v, 0.5f, 0.01f);
}

// Every encoding with B44 or DWA changes a value a little.
TEST_F(ExrWriter, LossyColorThatIsAsReadIsCopied) {
    for (const auto compression : {Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION,
                                   Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION})
        for (const auto& [name, tile] : {std::pair{"", 0}, {"color", 0}, {"color", 16}}) {
            SCOPED_TRACE(concat("compression ", int(compression), ", tile ", tile));
            FilePart part{.name = name,
                          .channels = {{"R"}, {"G"}, {"B"}, {"A"}},
                          .data = {{-3, 2}, {60, 65}},
                          .compression = compression,
                          .tile = tile};
            std::vector<FilePart> parts = {part};
            if (*name != 0) parts.push_back({.name = "other", .channels = {{"Z"}}});
            write_file(in, parts);
            ReadFile frame = read_ok(in);
            const ImageF before = color_of(in);
            WriteOptions options{.on_existing = OnExisting::overwrite};
            options.attributes["postchain"] = "a longer header";
            EXPECT_THAT(write_ok(out, frame, before, options).notes, IsEmpty());
            EXPECT_EQ(color_of(out).data, before.data);
            // The chunks after header and table.
            constexpr size_t kMaxHeader = 2048;
            const std::string stored = read_text(in);
            ASSERT_GT(stored.size(), 2 * kMaxHeader);
            EXPECT_TRUE(read_text(out).ends_with(stored.substr(kMaxHeader)));
            // If one value differs, the whole part is encoded.
            ImageF other = before;
            other.at(5, 6, 1) = 8;
            EXPECT_THAT(write_ok(out, frame, other, options).notes, IsEmpty());
            EXPECT_NEAR(color_of(out).at(5, 6, 1), 8, 0.2f);
            // A note says if the chunks do not fit.
            options.exr.channels = {"R", "G", "B"};
            EXPECT_THAT(write_ok(out, frame, before, options).notes,
                        ElementsAre(HasSubstr("packed anew with")));
            options.exr.channels.clear();
            options.exr.compression = *ExrCompression::parse("dwaa:45");
            EXPECT_THAT(write_ok(out, frame, before, options).notes,
                        ElementsAre(HasSubstr("packed anew with dwaa")));
            options.exr.compression = *ExrCompression::parse("zip");
            EXPECT_THAT(write_ok(out, frame, before, options).notes, IsEmpty());
            EXPECT_EQ(color_of(out).data, before.data);
        }
    // Tiles of a single-part file: a note.
    write_file(in, {{.channels = {{"R"}, {"G"}, {"B"}, {"A"}},
                     .data = {{0, 0}, {63, 63}},
                     .compression = Imf::DWAA_COMPRESSION,
                     .tile = 16}});
    ReadFile frame = read_ok(in);
    EXPECT_THAT(write_ok(out, frame, color_of(in), {.on_existing = OnExisting::overwrite}).notes,
                ElementsAre(HasSubstr("tiles of a file of one part")));
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
    // Under skip it stays.
    const std::string bytes = test::read_text(path);
    EXPECT_TRUE(write_planes_exr(path, depth, {"Z"}, OnExisting::skip).ok());
    EXPECT_TRUE(test::read_text(path) == bytes);
}

TEST(PlanesWriter, IntegersAreRoundedIntoTheirRange) {
    const test::TempFolder folder;
    ImageF values(6, 1, 1);
    values.data = {-7, NAN, 2.5f, 4294967040.0f, 4294967296.0f, INFINITY};
    must(write_planes_exr(folder.path("f.exr"),
                          {.channels = {{"id", PixelType::uint32, &values, 0}}}));
    const auto back = must(must(ExrFile::open(folder.path("f.exr"))).read_part(0));
    std::array<uint32_t, 6> stored;
    std::memcpy(stored.data(), back.planes[0].bytes.get(), sizeof(stored));
    EXPECT_THAT(stored, ElementsAre(0, 0, 3, 4294967040u, 4294967295u, 4294967295u));
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
