// Images of the page, taken apart again with zlib and a decoder of this file's own.
#include "tools/measure/report/page/encode.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace postchain::report {
namespace {

std::vector<uint8_t> from_base64(const std::string& text) {
    std::vector<uint8_t> bytes;
    uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        if (c == '=') break;
        const std::string digits =
            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        const size_t digit = digits.find(c);
        if (digit == std::string::npos) {
            ADD_FAILURE() << "not base64: " << c;
            return {};
        }
        bits = bits << 6 | uint32_t(digit);
        count += 6;
        if (count >= 8) {
            count -= 8;
            bytes.push_back(uint8_t(bits >> count));
        }
    }
    return bytes;
}

std::vector<uint8_t> inflated(const Result<std::string>& text, size_t expected) {
    EXPECT_TRUE(text.ok());
    const auto packed = from_base64(*text);
    std::vector<uint8_t> bytes(expected + 1);
    uLongf size = bytes.size();
    EXPECT_EQ(uncompress(bytes.data(), &size, packed.data(), packed.size()), Z_OK);
    bytes.resize(size);
    EXPECT_EQ(bytes.size(), expected);
    return bytes;
}

// Value of an IEEE 754 binary16 pattern, by its definition.
double value_of_half(uint16_t bits) {
    const double sign = bits & 0x8000 ? -1 : 1;
    const int exponent = bits >> 10 & 31;
    const int fraction = bits & 1023;
    if (exponent == 31) return fraction ? NAN : sign * INFINITY;
    if (exponent == 0) return sign * std::ldexp(fraction, -24);
    return sign * std::ldexp(1024 + fraction, exponent - 25);
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

TEST(Encode, WhatHalfCannotHold) {
    const float inf = std::numeric_limits<float>::infinity();
    const float given[] = {NAN, inf, -inf, 1e6f, -1e6f, 65504, 1e-12f};
    const double held[] = {NAN, inf, -inf, 65504, -65504, 65504, 0};
    for (size_t i = 0; i < std::size(given); ++i) {
        ImageF image(1, 1, 3, given[i]);
        const auto bytes = inflated(encode_color(image), 6);
        const double value = value_of_half(uint16_t(bytes[0] << 8 | bytes[3]));
        if (std::isnan(held[i]))
            EXPECT_TRUE(std::isnan(value));
        else
            EXPECT_EQ(value, held[i]) << given[i];
    }
}

// Rounding to 11 bits: at most 2^-11 of the value.
TEST(Encode, ColorComesBack) {
    ImageF image(37, 23, 3);
    for (size_t i = 0; i < image.data.size(); ++i)
        image.data[i] = std::exp2(float(i % 27) - 12) * (1 + float(i * 7919 % 1000) / 1000);
    const size_t count = image.data.size();
    const auto bytes = inflated(encode_color(image), 2 * count);
    size_t at = 0;
    for (int c = 0; c < 3; ++c) {
        std::vector<uint16_t> column(37 * 23);
        for (int y = 0; y < 23; ++y)
            for (int x = 0; x < 37; ++x, ++at) {
                const uint16_t step = uint16_t(bytes[at] << 8 | bytes[count + at]);
                const uint16_t before = x   ? column[size_t(y * 37 + x - 1)]
                                        : y ? column[size_t((y - 1) * 37)]
                                            : uint16_t(0);
                column[size_t(y * 37 + x)] = uint16_t(before + step);
                const double value = value_of_half(column[size_t(y * 37 + x)]);
                ASSERT_NEAR(value, image.at(x, y, c), image.at(x, y, c) * 0x1p-11);
            }
    }
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
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(x + y + c) / 512;
    const auto text = encode_color(image);
    ASSERT_TRUE(text.ok());
    EXPECT_LT(text->size(), size_t(256 * 256 * 6 / 4));
}

// A file for a page: the same planes after a header, without base64.
TEST(PictureFile, HasItsSizeAndThePlanesOfThePage) {
    ImageF image(3, 2, 1);
    for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(i) / 4;
    const auto file = picture_file(image);
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file->substr(0, 16), std::string("PPIC\3\0\0\0\2\0\0\0\1\0\0\0", 16));
    const auto packed = from_base64(*encode_color(image));
    EXPECT_EQ(file->substr(16), std::string(packed.begin(), packed.end()));
}

}  // namespace
}  // namespace postchain::report
