// Pictures for people: tone curves, contact sheets and PNG previews.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/zip.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/image_writer.h"
#include "tools/sequence/image/png.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {
namespace {

using test::read_text;
using test::TempFolder;
using testing::ElementsAre;

struct CurvePoint {
    Curve curve;
    double stored, light;
};

// At points computed from their standards.
TEST(Transfer, CurvesMeetTheirStandards) {
    const CurvePoint points[] = {
        {Curve::linear, -0.5, -0.5},
        // IEC 61966-2-1: ((v + 0.055) / 1.055)^2.4, or v / 12.92.
        {Curve::srgb, 0.5, 0.2140411},
        {Curve::srgb, 0.04, 0.0030960},
        // BT.2020-2: ((v + a - 1) / a)^(1 / 0.45) with a = 1.0992968, or v / 4.5.
        {Curve::rec709, 0.5, 0.2597194},
        {Curve::rec709, 0.04, 0.0088889},
        {Curve::gamma22, 0.5, 0.2176376},
        {Curve::gamma22, -0.5, -0.2176376},
        // Codes of 10 bits: white 685, black 95, and 10^((445 - 685) 0.002 / 0.6) without black.
        {Curve::cineon, 685 / 1023.0, 1},
        {Curve::cineon, 95 / 1023.0, 0},
        {Curve::cineon, 445 / 1023.0, 0.1493036}};
    for (const CurvePoint& point : points) {
        SCOPED_TRACE(concat(name_of(point.curve), " ", point.stored));
        EXPECT_NEAR(decode(point.curve, point.stored), point.light, 1e-6);
        EXPECT_NEAR(encode(point.curve, decode(point.curve, point.stored)), point.stored, 1e-12);
    }
}

TEST(ContactSheet, PicturesAreShrunkByABox) {
    ImageF picture(3, 2, 1);
    picture.data = {0, 3, 9, 0, 3, std::numeric_limits<float>::quiet_NaN()};
    // A pixel covers one and a half: (0 + 3 / 2) / 1.5 and (3 / 2 + 9) / 1.5; NaN counts as 0.
    EXPECT_THAT(shrunk(picture, 2, 2).data, ElementsAre(1, 7, 1, 1));
    EXPECT_THAT(shrunk(picture, 3, 1).data, ElementsAre(0, 3, 4.5f));
}

TEST(ContactSheet, FramesAreChosenEvenlyWithTheFirstAndTheLast) {
    EXPECT_THAT(evenly_chosen(10, 4), ElementsAre(0, 3, 6, 9));
    EXPECT_THAT(evenly_chosen(3, 5), ElementsAre(0, 1, 2));
    EXPECT_THAT(evenly_chosen(5, 1), ElementsAre(0));
    EXPECT_THAT(evenly_chosen(0, 3), ElementsAre());
}

// The pixels of one gray: left, top, right, bottom, number.
std::array<int, 5> pixels_of(const Image<uint8_t>& picture, uint8_t gray) {
    std::array<int, 5> box = {picture.width, picture.height, -1, -1, 0};
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const uint8_t* pixel = picture.pixel(x, y);
            if (std::ranges::count(pixel, pixel + 3, gray) != 3) continue;
            box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x),
                   std::max(box[3], y), box[4] + 1};
        }
    return box;
}

TEST(ContactSheet, EverythingHasItsPlace) {
    // Five cells in two columns, each of two images of 6x4 pixels; 12 pixels between cells, and 24
    // below each for its label.
    ContactSheet sheet({.cells = 5, .columns = 2, .sides = 2, .width = 6, .height = 4});
    const Image<uint8_t>& picture = sheet.picture();
    EXPECT_EQ(picture.width, 12 + 2 * (2 * 6 + 12));
    EXPECT_EQ(picture.height, 12 + 3 * (4 + 24) + 24);
    using Box = std::array<int, 5>;
    sheet.put(3, 1, Image<uint8_t>(4, 2, 3, 200));
    sheet.put(4, 0, Image<uint8_t>(6, 4, 1, 100));
    EXPECT_EQ(pixels_of(picture, 200), (Box{43, 41, 46, 42, 8}));
    EXPECT_EQ(pixels_of(picture, 100), (Box{12, 68, 17, 71, 24}));
    sheet.say(0, 1, ".");  // a character that is not drawn
    EXPECT_EQ(pixels_of(picture, 48), (Box{18, 12, 23, 15, 24}));
    EXPECT_EQ(pixels_of(picture, 150)[4], 0);
    // The 10 dots of a 1, and the 5 of a minus, each of 2x2 pixels.
    sheet.label(1, "1");
    EXPECT_EQ(pixels_of(picture, 220), (Box{39, 21, 44, 34, 40}));
    sheet.footer("-");
    EXPECT_EQ(pixels_of(picture, 150), (Box{12, 103, 21, 104, 20}));
}

std::vector<int> shown(const ImageF& color, const PreviewOptions& options = {}) {
    const TempFolder folder;
    const std::string path = folder.path("p.png");
    const Status s = write_png_preview(path, color, options);
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_THAT(folder.names(), ElementsAre("p.png"));
    const auto in = OIIO::ImageInput::open(path);
    if (in == nullptr) return {};
    EXPECT_STREQ(in->format_name(), "png");
    std::vector<uint8_t> bytes(in->spec().image_pixels() * size_t(in->spec().nchannels));
    EXPECT_TRUE(in->read_image(0, 0, 0, in->spec().nchannels, OIIO::TypeDesc::UINT8, bytes.data()));
    return {bytes.begin(), bytes.end()};
}

TEST(Preview, DisplayCurve) {
    // v = 1: (1/2)^(1/2.2) = 0.72974, x255 = 186.08. v = 3: 0.75^(1/2.2) = 0.87742, 223.74.
    // v = 0.25: 0.2^(1/2.2) = 0.48116, 122.70.
    ImageF color(2, 1, 4, 1);
    color.data = {1, 3, 0.25f, 1, 0, -5, std::numeric_limits<float>::quiet_NaN(), 1};
    EXPECT_THAT(shown(color), ElementsAre(186, 224, 123, 0, 0, 0));
    // One stop up: 0.5 is shown as 1 was.
    color.data = {0.5f, 1.5f, 0.125f, 1, 0, 0, 0, 0};
    EXPECT_THAT(shown(color, {.exposure_stops = 1}), ElementsAre(186, 224, 123, 0, 0, 0));
}

TEST(Preview, OtherCurvesAndGray) {
    // 0.5^(1/2.2) = 0.72974: 186.
    ImageF color(1, 1, 3);
    color.data = {0.5f, 1, 7};
    EXPECT_THAT(shown(color, {.curve = ToneCurve::gamma}), ElementsAre(186, 255, 255));
    EXPECT_THAT(shown(color, {.curve = ToneCurve::none}), ElementsAre(128, 255, 255));
    ImageF gray(2, 1, 1);
    gray.data = {0, 1};
    EXPECT_THAT(shown(gray, {.curve = ToneCurve::none}), ElementsAre(0, 255));
}

// OpenImageIO finds the text too, and it is read only from a complete file.
TEST(Preview, KeepsItsProvenance) {
    const TempFolder folder;
    const std::string path = folder.path("p.png");
    const ImageF color(3, 2, 3);
    ASSERT_TRUE(write_png_preview(path, color, {.provenance = "work 12 shown 34"}).ok());
    EXPECT_EQ(preview_provenance(path), "work 12 shown 34");
    const auto in = OIIO::ImageInput::open(path);
    ASSERT_NE(in, nullptr) << OIIO::geterror();
    EXPECT_EQ(in->spec().get_string_attribute("postchain"), "work 12 shown 34");
    const std::string whole = read_text(path);
    test::MemoryFile memory;
    const auto provenance_of = [&](const std::string& bytes) {
        memory.set(bytes);
        return preview_provenance(memory.path());
    };
    for (size_t at = 0; at < whole.size(); ++at) {
        EXPECT_EQ(provenance_of(whole.substr(0, at)), "") << at;
        std::string damaged = whole;
        damaged[at] = char(damaged[at] ^ 4);
        EXPECT_EQ(provenance_of(damaged), "") << at;
    }
    EXPECT_EQ(provenance_of(whole + "more"), "");
    EXPECT_EQ(provenance_of(whole), "work 12 shown 34");
    EXPECT_EQ(preview_provenance(folder.path("none.png")), "");
    EXPECT_EQ(provenance_of(with_png_text(whole, "author", "me")), "work 12 shown 34");
    // A keyword without a text, which has no zero byte behind it.
    std::string bare = whole;
    const size_t size = bare.find("tEXtpostchain") - 4, after = size + 8 + 9;
    bare.erase(after, bare.find("IDAT") - 4 - 4 - after);
    bare[size + 3] = 9;
    const uint32_t sum = crc32_of(bare.substr(size + 4, 4 + 9));
    for (size_t i = 0; i < 4; ++i) bare[after + i] = char(sum >> (24 - 8 * i));
    EXPECT_EQ(provenance_of(bare), "");
    EXPECT_EQ(provenance_of(with_png_text(bare, "postchain", "x")), "x");
    ASSERT_TRUE(write_png_preview(folder.path("plain.png"), color).ok());
    EXPECT_EQ(preview_provenance(folder.path("plain.png")), "");
}

TEST(Preview, UnwritablePathIsAnError) {
    const TempFolder folder;
    EXPECT_EQ(write_png_preview(folder.path("none/p.png"), ImageF(1, 1, 3)).code(),
              StatusCode::output);
}

// A value that does not fit, above and below.
TEST(ImageWriter, RefusesOrCountsWhatDoesNotFit) {
    const TempFolder folder;
    const std::string path = folder.path("o.png");
    for (const float value : {1.5f, -0.1f, std::numeric_limits<float>::infinity(),
                              -std::numeric_limits<float>::infinity(), NAN}) {
        ImageF color(3, 2, 4, 0.5f);
        color.at(1, 1, 2) = value;
        const ImageEncoding encoding = {.format = image_format_of(path)};
        const auto write = [&](HalfOverflow overflow) {
            return write_picture(path, color, encoding, "", 0, {.overflow = overflow});
        };
        EXPECT_THAT(test::error_of(write(HalfOverflow::refuse)),
                    testing::HasSubstr("1 pixels do not fit"));
        EXPECT_THAT(folder.names(), testing::IsEmpty());
        const WriteReport report = test::must(write(HalfOverflow::clamp));
        EXPECT_EQ(report.overflow_pixels, std::isfinite(value) ? 1u : 0u) << value;
        EXPECT_EQ(report.nonfinite_pixels, std::isfinite(value) ? 0u : 1u) << value;
        const ImageF back = test::must(test::must(ImageFile::open(path)).read_channels(0, {"B"}));
        EXPECT_EQ(back.at(1, 1), value > 1 ? 1 : 0) << value;
        std::filesystem::remove(path);
    }
}

// As the input where the format has it.
TEST(ImageWriter, ChoosesBitsAlphaAndTransfer) {
    struct Row {
        const char* input;
        int bits, channels;
        const char* output;
        int to_bits;
        bool alpha, unassociated;
        Curve transfer;
    };
    constexpr auto srgb = Curve::srgb, linear = Curve::linear;
    const TempFolder folder;
    for (const Row& row : {Row{"i.png", 8, 4, "o.png", 8, true, true, srgb},
                           {"i.png", 16, 4, "o.tif", 16, true, false, srgb},
                           {"i.png", 16, 3, "o.png", 16, false, false, srgb},
                           {"i.png", 16, 4, "o.jpg", 8, false, false, srgb},
                           {"i.png", 16, 4, "o.dpx", 16, true, false, srgb},
                           {"i.png", 8, 4, "o.hdr", 32, false, false, linear},
                           {"i.tif", 32, 4, "o.png", 16, true, true, srgb},
                           {"i.tif", 32, 4, "o.tif", 32, true, false, linear},
                           {"i.tif", 32, 4, "o.dpx", 10, true, false, srgb}}) {
        SCOPED_TRACE(concat(row.input, " ", row.bits, " ", row.output));
        const std::string path = folder.path(row.input);
        const bool is_float = row.bits == 32;
        test::must(write_picture(path, ImageF(3, 4, 4, 0.5f),
                                 {.format = image_format_of(path),
                                  .bits = row.bits,
                                  .alpha = row.channels == 4,
                                  .unassociated = path.ends_with(".png") && row.channels == 4,
                                  .transfer = is_float ? linear : srgb,
                                  .color_space = is_float ? "Linear" : "sRGB"},
                                 "", 0, {.on_existing = OnExisting::overwrite}));
        const auto input = test::must(ImageFile::open(path));
        const auto made = test::must(image_encoding(row.output, input, size_t(row.channels), {}));
        EXPECT_EQ(made.bits, row.to_bits);
        EXPECT_EQ(made.alpha, row.alpha);
        EXPECT_EQ(made.unassociated, row.unassociated);
        EXPECT_EQ(std::get<Curve>(made.transfer), row.transfer);
        EXPECT_EQ(made.same_transfer, is_float == (row.transfer == linear));
        EXPECT_FALSE(image_encoding(row.output, input, 3, {.bits = 11}).ok());
    }
}

// Alpha is not decoded; limits are inclusive.
TEST(ImageFile, DecodesFloatsAndHasLimits) {
    const TempFolder folder;
    const std::string path = folder.path("i.tif");
    ImageF color(3, 4, 4, 0.5f);
    test::must(write_picture(path, color,
                             {.format = image_format_of(path),
                              .bits = 32,
                              .alpha = true,
                              .transfer = Curve::linear,
                              .pixel_aspect = 2},
                             "", 0, {}));
    auto file = test::must(ImageFile::open(path, {}, Curve::srgb));
    const ImageF light = test::must(file.read_channels(0, {"G", "A"}));
    EXPECT_NEAR(light.at(2, 3, 0), 0.2140411, 1e-6);
    EXPECT_EQ(light.at(2, 3, 1), 0.5f);
    EXPECT_EQ(file.parts()[0].pixel_aspect, 2);
    const uint64_t bytes = 3 * 4 * 4 * sizeof(float);
    EXPECT_TRUE(ImageFile::open(path, {.max_side = 4, .max_bytes = bytes}).ok());
    EXPECT_THAT(test::error_of(ImageFile::open(path, {.max_side = 3})),
                testing::HasSubstr("at most 3 a side"));
    EXPECT_THAT(test::error_of(ImageFile::open(path, {.max_bytes = bytes - 1})),
                testing::HasSubstr("more than are read"));
}

// A DPX without a pixel aspect holds zeros, whose quotient is 0, infinity or NaN.
TEST(ImageFile, APixelAspectThatIsNoneIsOne) {
    const TempFolder folder;
    const std::string path = folder.path("i.dpx");
    test::must(
        write_picture(path, ImageF(3, 4, 4, 0.5f), {.format = image_format_of(path)}, "", 0, {}));
    std::string bytes = read_text(path);
    constexpr size_t kAt = 1628;  // of two numbers: across, down
    const size_t low = bytes.starts_with("SDPX") ? 3 : 0;
    for (const auto& [across, down, aspect] :
         {std::tuple(2, 1, 2.0), {1, 2, 0.5}, {0, 0, 1.0}, {0, 1, 1.0}, {1, 0, 1.0}}) {
        bytes.replace(kAt, 8, std::string(8, '\0'));
        bytes[kAt + low] = char(across);
        bytes[kAt + 4 + low] = char(down);
        test::write_text(path, bytes);
        EXPECT_EQ(test::must(ImageFile::open(path)).parts()[0].pixel_aspect, aspect)
            << across << ":" << down;
    }
}

// Its pixels are kept until the whole image has been read.
TEST(ImageFile, KeepsItsPixelsOnlyBetweenReadsOfRows) {
    const TempFolder folder;
    const std::string path = folder.path("i.png");
    test::must(
        write_picture(path, ImageF(3, 4, 4, 0.5f), {.format = image_format_of(path)}, "", 0, {}));
    auto rows = test::must(ImageFile::open(path)), whole = test::must(ImageFile::open(path));
    test::must(rows.read_part(0, {"R"}, Window{0, 0, 2, 1}));
    test::must(whole.read_part(0, {"R"}));
    std::filesystem::remove(path);
    EXPECT_TRUE(rows.read_part(0, {"R"}, Window{0, 2, 2, 3}).ok());
    EXPECT_FALSE(whole.read_part(0, {"R"}, Window{0, 2, 2, 3}).ok());
}

}  // namespace
}  // namespace postchain::io
