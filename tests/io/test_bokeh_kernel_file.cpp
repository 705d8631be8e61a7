// Images of apertures in several formats, and refused files.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::io::test_bokeh_kernel_file {
namespace {

using test::must;
using test::TempFolder;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kSide = BokehKernel::kSide;

using Edit = std::function<void(OIIO::ImageSpec&)>;

class ApertureFile : public testing::Test {
  protected:
    // Values row after row, channels interleaved.
    void write(const std::string& name, int width, int height, const std::vector<float>& values,
               OIIO::TypeDesc type = OIIO::TypeDesc::FLOAT, const Edit& edit = {}) {
        const auto out = OIIO::ImageOutput::create(path(name));
        OIIO::ImageSpec spec(width, height, int(values.size()) / (width * height), type);
        if (edit) edit(spec);
        EXPECT_TRUE(out && out->open(path(name), spec) &&
                    out->write_image(OIIO::TypeDesc::FLOAT, values.data()) && out->close())
            << OIIO::geterror();
    }
    std::vector<float> values_of(const std::string& name) {
        return must(read_aperture_image(path(name))).values();
    }
    std::string refused(const std::string& name) {
        const Status status = read_aperture_image(path(name)).status();
        EXPECT_EQ(status.code(), StatusCode::input);
        EXPECT_THAT(status.message(), testing::StartsWith(path(name) + ": "));
        return status.message();
    }
    std::string path(const std::string& name) const { return folder_.path(name); }

  private:
    const TempFolder folder_;
};

TEST_F(ApertureFile, OfTheTablesSizeIsTheTable) {
    std::vector<float> values;
    for (int i = 0; i < kSide * kSide; ++i) values.push_back(float(i % 977) / 100);
    write("a.exr", kSide, kSide, values);
    EXPECT_EQ(values_of("a.exr"), values);
    EXPECT_EQ(read_aperture_image(path("a.exr"))->file(), path("a.exr"));
}

// 8 bits are linear: 51 of 255 is a fifth for any stated color space.
TEST_F(ApertureFile, EightBitsAreTakenAsTheyAre) {
    for (const char* space : {"sRGB", "linear"}) {
        write("a.png", 2, 2, {0.2f, 1, 0.4f, 0}, OIIO::TypeDesc::UINT8,
              [&](OIIO::ImageSpec& spec) { spec.attribute("oiio:ColorSpace", space); });
        const auto values = values_of("a.png");
        EXPECT_FLOAT_EQ(values[0], 0.2f);
        EXPECT_FLOAT_EQ(values[kSide - 1], 1);
        EXPECT_FLOAT_EQ(values[64 * kSide], 0.4f);
        EXPECT_EQ(values[kSide * kSide - 1], 0);
    }
}

TEST_F(ApertureFile, ColorIsItsLuminanceAndAlphaCovers) {
    write("rgb.exr", 1, 1, {1, 0.5f, 2});
    EXPECT_NEAR(values_of("rgb.exr")[5], 0.2126 + 0.7152 / 2 + 0.0722 * 2, 1e-6);
    write("rgba.png", 1, 1, {0.6f, 0.6f, 0.6f, 0.6f}, OIIO::TypeDesc::UINT8);
    EXPECT_NEAR(values_of("rgba.png")[5], 0.6, 0.005);
    write("ya.png", 1, 1, {0.4f, 0.8f}, OIIO::TypeDesc::UINT8);
    EXPECT_NEAR(values_of("ya.png")[5], 0.4, 0.005);
}

// 192 pixels on 128 cells: a cell has one whole pixel and half of one beside it.
TEST_F(ApertureFile, IsResampledByABox) {
    std::vector<float> values;
    for (int i = 0; i < 192 * 192; ++i) values.push_back(float((i * 7919) % 541));
    write("a.exr", 192, 192, values);
    const auto table = values_of("a.exr");
    const auto at = [&](int x, int y) { return double(values[size_t(y * 192 + x)]); };
    EXPECT_NEAR(table[0], (4 * at(0, 0) + 2 * at(1, 0) + 2 * at(0, 1) + at(1, 1)) / 9, 1e-3);
    // Cell 3, 2: pixels 4.5 .. 6 across, 3 .. 4.5 down.
    EXPECT_NEAR(table[2 * kSide + 3], (2 * at(4, 3) + 4 * at(5, 3) + at(4, 4) + 2 * at(5, 4)) / 9,
                1e-3);
    const double sum = std::accumulate(values.begin(), values.end(), 0.0),
                 sum_of_table = std::accumulate(table.begin(), table.end(), 0.0);
    EXPECT_NEAR(sum_of_table / (kSide * kSide), sum / (192 * 192), 1e-3);
}

// A data window of 64 x 32 in a display window of 128: the rest is black.
TEST_F(ApertureFile, TheDisplayWindowCounts) {
    write("a.exr", 64, 32, std::vector<float>(64 * 32, 2), OIIO::TypeDesc::FLOAT,
          [](OIIO::ImageSpec& spec) {
              spec.x = 40;
              spec.y = 50;
              spec.full_x = spec.full_y = 0;
              spec.full_width = spec.full_height = 128;
          });
    const auto values = values_of("a.exr");
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            EXPECT_EQ(values[size_t(y * kSide + x)],
                      x >= 40 && x < 104 && y >= 50 && y < 82 ? 2 : 0);
}

// A DDS file whose header states a volume of two images.
TEST_F(ApertureFile, RefusesAVolume) {
    std::string bytes = "DDS ";
    const auto put = [&](uint32_t value) {
        for (int i = 0; i < 4; ++i) bytes.push_back(char(value >> (8 * i)));
    };
    const uint32_t kSize = 124, kFlags = 0x80100f;  // caps, size, format, pitch, depth
    for (const uint32_t value : {kSize, kFlags, 4u, 4u, 16u, 2u, 0u}) put(value);
    for (int i = 0; i < 11; ++i) put(0);
    // 32 bits of a pixel and which of them are red, green, blue and alpha.
    for (const uint32_t value : {32u, 0x41u, 0u, 32u, 0xffu, 0xff00u, 0xff0000u, 0xff000000u})
        put(value);
    for (const uint32_t value : {0x401008u, 0x200000u, 0u, 0u, 0u}) put(value);  // a volume
    bytes.append(4 * 4 * 4 * 2, char(0xff));
    test::write_text(path("a.dds"), bytes);
    EXPECT_THAT(refused("a.dds"), HasSubstr("is a volume"));
}

TEST_F(ApertureFile, RefusesWhatIsNoAperture) {
    EXPECT_THAT(refused("none.png"), HasSubstr("no such file"));
    EXPECT_THAT(refused(""), HasSubstr("is not a file"));
    test::write_text(path("text.png"), "not a picture");
    EXPECT_THAT(refused("text.png"), HasSubstr("cannot be read"));
    write("a.exr", 20, 10, std::vector<float>(200, 1));
    EXPECT_THAT(refused("a.exr"),
                AllOf(HasSubstr("20x10"), HasSubstr("square"), HasSubstr("crop")));
    std::vector<float> values(64 * 64, 1);
    for (const float bad : {-0.25f, NAN, INFINITY}) {
        values[5 * 64 + 9] = bad;
        write("a.exr", 64, 64, values);
        EXPECT_THAT(refused("a.exr"), HasSubstr(concat("pixel 9, 5 is ", bad)));
    }
    values.assign(64 * 64, 0);
    write("a.exr", 64, 64, values);
    EXPECT_THAT(refused("a.exr"), HasSubstr("black"));
    values[0] = 1;
    write("a.exr", 64, 64, values);
    EXPECT_THAT(refused("a.exr"), HasSubstr("corners alone"));
    write("wide.png", kMaxApertureSide + 1, 1, std::vector<float>(kMaxApertureSide + 1, 1),
          OIIO::TypeDesc::UINT8);
    EXPECT_THAT(refused("wide.png"), AllOf(HasSubstr("4097 pixels"), HasSubstr("smaller")));
    // Truncated.
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(i % 251);
    write("a.exr", 64, 64, values);
    const std::string bytes = test::read_text(path("a.exr"));
    test::write_text(path("a.exr"), bytes.substr(0, bytes.size() / 2));
    EXPECT_THAT(refused("a.exr"), HasSubstr("cannot be read"));
}

TEST_F(ApertureFile, IsReadOnce) {
    write("a.exr", 1, 1, {1});
    ApertureFiles files;
    Camera camera, again, none, missing;
    camera.aperture_image = again.aperture_image = BokehKernel(path("a.exr"));
    ASSERT_TRUE(files.read(camera).ok());
    std::filesystem::remove(path("a.exr"));
    EXPECT_TRUE(files.read(again).ok());
    EXPECT_EQ(again.aperture_image, camera.aperture_image);
    EXPECT_TRUE(again.aperture_image.is_read());
    EXPECT_TRUE(files.read(none).ok());
    EXPECT_FALSE(none.aperture_image);
    missing.aperture_image = BokehKernel(path("b.exr"));
    EXPECT_EQ(files.read(missing).code(), StatusCode::input);
}

}  // namespace
}  // namespace postchain::io::test_bokeh_kernel_file
