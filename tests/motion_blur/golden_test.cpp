// An independent double-precision implementation of the definitions, on a path-traced image.
//
// tests/data/motion_blur/wheels_crop.bin is a crop of 160 x 160 pixels on tile borders: color (half
// RGB), inverse depth and motion; and of the inner 80 x 80 pixels, which do not depend on pixels
// outside the crop, the results of modes guertin and single (float RGB). A text header ends in a
// line "end"; planes follow in the header's order, rows of little-endian numbers. N = 25, r = 40,
// shutter 0.5, s = 1, kappa = 40, no jitter.
#include <fstream>
#include <glm/gtc/packing.hpp>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

constexpr int kSize = 160, kInner = 80;  // pixels: of the planes, of the results
constexpr int kMargin = (kSize - kInner) / 2;

template <class T>
std::vector<T> read(std::ifstream& in, size_t count) {
    std::vector<T> values(count);
    in.read(reinterpret_cast<char*>(values.data()), std::streamsize(count * sizeof(T)));
    EXPECT_TRUE(in.good());
    return values;
}

ImageF read_image(std::ifstream& in, int size, int channels) {
    ImageF image(size, size, channels);
    image.data = read<float>(in, image.data.size());
    return image;
}

struct WheelsCrop {
    FramePlanes planes;      // color, inverse_depth, motion
    ImageF guertin, single;  // RGB of the inner pixels, by mode
};

WheelsCrop read_wheels_crop() {
    std::ifstream in(POSTCHAIN_SOURCE_DIR "/tests/data/motion_blur/wheels_crop.bin",
                     std::ios::binary);
    std::string line;
    while (std::getline(in, line) && line != "end") {
    }
    WheelsCrop crop;
    ImageF color(kSize, kSize, 4, 1.0f);
    const auto half = read<uint16_t>(in, 3 * color.pixels());
    for (size_t i = 0; i < color.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c) color.data[4 * i + c] = glm::unpackHalf1x16(half[3 * i + c]);
    crop.planes[Role::color] = std::move(color);
    crop.planes[Role::inverse_depth] = read_image(in, kSize, 1);
    crop.planes[Role::motion] = read_image(in, kSize, 2);
    crop.guertin = read_image(in, kInner, 3);
    crop.single = read_image(in, kInner, 3);
    return crop;
}

ImageF inner_of(const ImageF& image) {
    ImageF inner(kInner, kInner, 3);
    for (int y = 0; y < kInner; ++y)
        for (int x = 0; x < kInner; ++x)
            for (int c = 0; c < 3; ++c) inner.at(x, y, c) = image.at(x + kMargin, y + kMargin, c);
    return inner;
}

TEST(Golden, EqualsTheIndependentImplementation) {
    const WheelsCrop golden = read_wheels_crop();
    BlurFrame frame(kSize, kSize);
    frame.planes = golden.planes;
    // The crop is demanding: nine tenths of it differ between the modes.
    EXPECT_GT(compare(golden.guertin, golden.single, 0.01).fraction, 0.8);
    for (const auto& [mode, expected] :
         {std::pair("guertin", &golden.guertin), std::pair("single", &golden.single)}) {
        const Chain chain = plain_blur({{"mode", mode}, {"shutter_frames", 0.5}});
        const Difference gpu = compare(inner_of(blurred(chain, frame)), *expected, 1e-3);
        EXPECT_LE(gpu.fraction, 0.001) << mode << ": " << gpu.text;
        const auto reference = reference_stages_of(chain, frame);
        const Difference cpu =
            compare(inner_of(image_cast<float>(reference.at("color"))), *expected, 1e-3);
        EXPECT_LE(cpu.fraction, 0.001) << mode << ": " << cpu.text;
    }
}

}  // namespace
}  // namespace postchain::test
