#include "tests/support/wheels_crop.h"

#include <gtest/gtest.h>

#include <fstream>
#include <glm/gtc/packing.hpp>

namespace postchain::test {
namespace {

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

}  // namespace

WheelsCrop read_wheels_crop() {
    constexpr int kSize = WheelsCrop::kSize, kInner = WheelsCrop::kInner;
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

}  // namespace postchain::test
