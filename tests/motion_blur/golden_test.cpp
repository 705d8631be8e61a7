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

constexpr int kSize = 160, kMargin = 40, kInner = 80;

struct Golden {
    BlurFrame frame{kSize, kSize};
    ImageF guertin{kInner, kInner, 3};
    ImageF single{kInner, kInner, 3};
};

template <class T>
std::vector<T> read(std::ifstream& in, size_t count) {
    std::vector<T> values(count);
    in.read(reinterpret_cast<char*>(values.data()), std::streamsize(count * sizeof(T)));
    EXPECT_TRUE(in.good());
    return values;
}

Golden load() {
    Golden golden;
    std::ifstream in(POSTCHAIN_SOURCE_DIR "/tests/data/motion_blur/wheels_crop.bin",
                     std::ios::binary);
    std::string line;
    while (std::getline(in, line) && line != "end") {
    }
    EXPECT_TRUE(in.good());
    const size_t pixels = size_t(kSize * kSize);
    const auto color = read<uint16_t>(in, 3 * pixels);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c)
            golden.frame.color().data[4 * i + c] = glm::unpackHalf1x16(color[3 * i + c]);
    golden.frame.depth().data = read<float>(in, pixels);
    golden.frame.motion().data = read<float>(in, 2 * pixels);
    golden.guertin.data = read<float>(in, golden.guertin.data.size());
    golden.single.data = read<float>(in, golden.single.data.size());
    return golden;
}

ImageF inner_of(const ImageF& image) {
    ImageF inner(kInner, kInner, 3);
    for (int y = 0; y < kInner; ++y)
        for (int x = 0; x < kInner; ++x)
            for (int c = 0; c < 3; ++c) inner.at(x, y, c) = image.at(x + kMargin, y + kMargin, c);
    return inner;
}

TEST(Golden, EqualsTheIndependentImplementation) {
    const Golden golden = load();
    // The crop is demanding: nine tenths of it differ between the modes.
    EXPECT_GT(compare(golden.guertin, golden.single, 0.01).fraction, 0.8);
    for (const auto& [mode, expected] :
         {std::pair("guertin", &golden.guertin), std::pair("single", &golden.single)}) {
        const Chain chain = plain_blur({{"mode", mode}, {"shutter_frames", 0.5}});
        const Difference gpu = compare(inner_of(blurred(chain, golden.frame)), *expected, 1e-3);
        EXPECT_LE(gpu.fraction, 0.001) << mode << ": " << gpu.text;
        const auto reference = reference_stages_of(chain, golden.frame);
        const Difference cpu =
            compare(inner_of(image_cast<float>(reference.at("color"))), *expected, 1e-3);
        EXPECT_LE(cpu.fraction, 0.001) << mode << ": " << cpu.text;
    }
}

}  // namespace
}  // namespace postchain::test
