// Images of the page, taken apart again with zlib and a decoder of this file's own.
#include "tools/page/encode.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tests/support/status.h"

namespace postchain::page {
namespace {

std::string from_base64(const std::string& text) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    uint32_t bits = 0;
    int count = 0;
    for (const char c : text.substr(0, text.find('='))) {
        EXPECT_NE(digits.find(c), std::string::npos) << c;
        bits = bits << 6 | uint32_t(digits.find(c));
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes.push_back(char(bits >> count));
    }
    return bytes;
}

std::vector<uint8_t> inflated(const Result<std::string>& text, size_t expected) {
    const std::string packed = from_base64(test::must(text));
    std::vector<uint8_t> bytes(expected + 1);
    uLongf size = bytes.size();
    EXPECT_EQ(uncompress(bytes.data(), &size, reinterpret_cast<const Bytef*>(packed.data()),
                         packed.size()),
              Z_OK);
    bytes.resize(size);
    EXPECT_EQ(bytes.size(), expected);
    return bytes;
}

// By hand: 2x2, so that every neighbor occurs.
//   red    1      2        halves 3c00 4000
//          0.5   -1               3800 bc00
// differences: 3c00 - 0, 4000 - 3c00 = 0400; second row: 3800 - 3c00 (above) = fc00,
// bc00 - 3800 = 8400. Green and blue are 0.
TEST(Encode, ColorAsWorkedOutByHand) {
    ImageF image(2, 2, 3);
    image.at(0, 0, 0) = 1;
    image.at(1, 0, 0) = 2;
    image.at(0, 1, 0) = 0.5f;
    image.at(1, 1, 0) = -1;
    std::vector<uint8_t> expected(24, 0);
    const uint8_t high[] = {0x3c, 0x04, 0xfc, 0x84};
    std::copy(std::begin(high), std::end(high), expected.begin());
    EXPECT_EQ(inflated(encode_color(image), 24), expected);
}

TEST(Encode, LowBytesFollowTheHighOnes) {
    ImageF image(1, 1, 3);
    image.at(0, 0, 1) = 1 + 5.0f / 1024;  // 3c05
    image.at(0, 0, 2) = 1 + 1.0f / 1024;  // 3c01; channels begin anew
    const std::vector<uint8_t> expected = {0, 0x3c, 0x3c, 0, 5, 1};
    EXPECT_EQ(inflated(encode_color(image), 6), expected);
}

TEST(Encode, HalvesOfEveryKind) {
    const float inf = std::numeric_limits<float>::infinity();
    const std::pair<float, int> rows[] = {
        {inf, 0x7c00}, {-inf, 0xfc00}, {1e6f, 0x7bff}, {-1e6f, 0xfbff},   {65504, 0x7bff},
        {1e-12f, 0},   {0x1p-24f, 1},  {0.1f, 0x2e66}, {1000.3f, 0x63d1}, {-0.5f, 0xb800}};
    const auto half_of = [](float value) {
        const auto bytes = inflated(encode_color(ImageF(1, 1, 3, value)), 6);
        return bytes[0] << 8 | bytes[3];
    };
    for (const auto& [value, half] : rows) EXPECT_EQ(half_of(value), half) << value;
    EXPECT_GT(half_of(NAN) & 0x7fff, 0x7c00);
}

// 0, 1/2, 1 -> 0, 128 (rounded away from 127.5), 255; limits and NaN.
TEST(Encode, MapInEightBits) {
    ImageF map(6, 1, 1);
    const float values[] = {0, 0.5f, 1, 2, -1, NAN};
    std::copy(std::begin(values), std::end(values), map.data.begin());
    const std::vector<uint8_t> expected = {0, 128, 127, 0, 1, 255};  // 0 128 255 255 0 255
    EXPECT_EQ(inflated(encode_map(map), 6), expected);
}

TEST(Encode, SmoothPicturesShrink) {
    ImageF image(256, 256, 3);
    for (size_t i = 0; i < image.data.size(); ++i)
        image.data[i] = float(i) / float(image.data.size());
    EXPECT_LT(test::must(encode_color(image)).size(), size_t(256 * 256 * 6 / 4));
}

// A file for a page: the same planes after a header, without base64.
TEST(PictureFile, HasItsSizeAndThePlanesOfThePage) {
    ImageF image(3, 2, 1);
    for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(i) / 4;
    const auto file = picture_file(image);
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file->substr(0, 16), std::string("PPIC\3\0\0\0\2\0\0\0\1\0\0\0", 16));
    EXPECT_EQ(file->substr(16), from_base64(*encode_color(image)));
}

}  // namespace
}  // namespace postchain::page
