#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/io/exr_files.h"
#include "tools/sequence/image/preview.h"

namespace postchain::io {
namespace {

using test::read_text;
using test::TempFolder;
using testing::ElementsAre;

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
    for (size_t at = 0; at < whole.size(); ++at) {
        memory.set(whole.substr(0, at));
        EXPECT_EQ(preview_provenance(memory.path()), "") << at;
        std::string damaged = whole;
        damaged[at] = char(damaged[at] ^ 4);
        memory.set(damaged);
        EXPECT_EQ(preview_provenance(memory.path()), "") << at;
    }
    memory.set(whole + "more");
    EXPECT_EQ(preview_provenance(memory.path()), "");
    memory.set(whole);
    EXPECT_EQ(preview_provenance(memory.path()), "work 12 shown 34");
    EXPECT_EQ(preview_provenance(folder.path("none.png")), "");
    const std::string plain = folder.path("plain.png");
    ASSERT_TRUE(write_png_preview(plain, color).ok());
    EXPECT_EQ(preview_provenance(plain), "");
}

TEST(Preview, UnwritablePathIsAnError) {
    const TempFolder folder;
    EXPECT_EQ(write_png_preview(folder.path("none/p.png"), ImageF(1, 1, 3)).code(),
              StatusCode::output);
}

}  // namespace
}  // namespace postchain::io
