// Color values that write_filtered() writes: out of range, rounded, compressed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::read_text;
using test::write_file;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kMost = std::numeric_limits<float>::max();

struct Sample {
    int x, y, channel;
    float given, written;
};

struct Overflow {
    Imf::PixelType type;
    std::vector<Sample> samples;
    uint64_t finite, nonfinite;  // pixels that do not fit
    const char* remedy;
};

TEST_F(ExrWriter, ColorThatDoesNotFitIsRefusedOrClampedNeverInf) {
    const std::vector<Sample> halves = {{1, 0, 0, 65505, 65504},
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
                                Overflow{Imf::FLOAT, floats, 0, 2, "--overflow clamp"}}) {
        FilePart part = every_type();
        for (size_t c = 0; c < 4; ++c) part.channels[c].type = one.type;
        write_file(in, {part});
        std::filesystem::remove(out);
        InputFrame frame = read_ok(in);
        ImageF color = new_color(frame), expected = color;
        for (const Sample& sample : one.samples) {
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

ImageF color_of(const std::string& path) {
    return must(must(ExrFile::open(path)).read_channels(0, kRgba));
}

// 2049 lies between the halves 2048 and 2050: to even. 2051 between 2050 and 2052: to 2052.
TEST_F(ExrWriter, RoundsToTheNearestHalf) {
    write_file(in, {every_type()});
    InputFrame frame = read_ok(in);
    ImageF color = new_color(frame);
    for (size_t i = 0; i < color.data.size(); ++i) color.data[i] = float(i % 2 == 0 ? 2049 : 2051);
    write_ok(out, frame, color);
    const ImageF back = color_of(out);
    for (size_t i = 0; i < back.data.size(); ++i)
        ASSERT_EQ(back.data[i], i % 2 == 0 ? 2048.0f : 2052.0f);
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
    InputFrame frame = read_ok(in);
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
            InputFrame frame = read_ok(in);
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
    InputFrame frame = read_ok(in);
    EXPECT_THAT(write_ok(out, frame, color_of(in), {.on_existing = OnExisting::overwrite}).notes,
                ElementsAre(HasSubstr("tiles of a file of one part")));
}

}  // namespace
}  // namespace postchain::io
