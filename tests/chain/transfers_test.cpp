// Planes go to textures and come back as they were; halves are rounded as IEEE 754 says.
#include "chain/gl/transfers.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "chain/gl/half.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

// By the definition: sign, exponent, significand.
double value_of_half(uint16_t half) {
    const int exponent = half >> 10 & 31, significand = half & 1023;
    const double sign = half & 0x8000 ? -1 : 1;
    if (exponent == 31)
        return significand ? std::nan("") : sign * std::numeric_limits<double>::infinity();
    if (exponent == 0) return sign * std::ldexp(significand, -24);
    return sign * std::ldexp(1024 + significand, exponent - 25);
}

// To 11 significant bits or a multiple of 2^-24, ties to even.
double rounded_to_half(double value) {
    const int exponent = std::max(std::ilogb(value), -14);
    const double step = std::ldexp(1.0, exponent - 10);
    const double near = std::nearbyint(value / step) * step;
    return std::abs(near) >= 65536 ? std::copysign(std::numeric_limits<double>::infinity(), value)
                                   : near;
}

TEST(Halves, AllOfThemBecomeTheirValues) {
    std::vector<uint16_t> halves(65536), again(65536);
    std::vector<float> values(65536);
    for (size_t i = 0; i < halves.size(); ++i) halves[i] = uint16_t(i);
    gl::from_halves(halves.data(), values.data(), halves.size());
    gl::to_halves(values.data(), again.data(), values.size());
    for (size_t i = 0; i < halves.size(); ++i) {
        const double expected = value_of_half(halves[i]);
        if (std::isnan(expected)) {
            EXPECT_TRUE(std::isnan(values[i])) << i;
            EXPECT_TRUE(std::isnan(value_of_half(again[i]))) << i;
        } else {
            EXPECT_EQ(double(values[i]), expected) << i;
            EXPECT_EQ(again[i], halves[i]);
        }
    }
}

TEST(Halves, FloatsAreRoundedToTheNearest) {
    std::vector<float> values;
    // Every exponent, with significands around each tie.
    for (uint32_t top = 0; top < 0x10000u; top += 7)
        for (const uint32_t rest : {0x0000u, 0x0001u, 0x0fffu, 0x1000u, 0x1001u, 0x2000u, 0x3000u})
            values.push_back(std::bit_cast<float>(top << 16 | rest));
    std::vector<uint16_t> halves(values.size());
    gl::to_halves(values.data(), halves.data(), values.size());
    for (size_t i = 0; i < values.size(); ++i) {
        const double half = value_of_half(halves[i]);
        if (std::isnan(values[i]))
            EXPECT_TRUE(std::isnan(half));
        else if (values[i] == 0 || std::isinf(values[i]))
            EXPECT_EQ(half, double(values[i]));
        else
            EXPECT_EQ(half, rounded_to_half(values[i])) << std::hexfloat << values[i];
        EXPECT_EQ(std::signbit(values[i]), (halves[i] & 0x8000) != 0);
    }
}

// Sizes of several pieces, of more than the ring has; rows of odd bytes.
class Transfers : public testing::TestWithParam<bool> {};

TEST_P(Transfers, PlanesComeBackAsTheyWere) {
    test::executor();  // makes the context
    gl::Transfers transfers(GetParam());
    gl::TexturePool pool;
    const struct {
        Format format;
        int width, height, slices;
    } cases[] = {{Format::rgba32f, 700, 501, 0}, {Format::rgba16f, 1021, 700, 0},
                 {Format::rg32f, 3, 5, 0},       {Format::r16f, 333, 77, 0},
                 {Format::r32f, 1, 1, 0},        {Format::rg16f, 1001, 303, 3},
                 {Format::rgba32f, 517, 203, 4}, {Format::r8, 31, 33, 0},
                 {Format::rg32f, 3, 2, 40}};
    for (size_t i = 0; i < 3 * std::size(cases); ++i) {
        const auto& [format, width, height, slices] = cases[i % std::size(cases)];
        const gl::Texture* texture = test::must(pool.acquire({format, width, height, slices}));
        ImageF pixels(width, height * std::max(slices, 1), channels_of(format));
        const bool bytes = format == Format::r8;
        for (size_t at = 0; at < pixels.data.size(); ++at)
            pixels.data[at] = bytes ? float(at % 3 == 1) : float(int(at * 31 % 2048) - 1024) / 8;
        ASSERT_EQ(test::error_of(transfers.upload(*texture, pixels)), "");
        EXPECT_TRUE(test::must(transfers.download(texture->name, *texture)) == pixels)
            << name_of(format) << " " << width << "x" << height;
    }
}

// A device that is behind has taken no piece of the ring yet: the rest waits.
TEST_P(Transfers, PlanesAreHandedOverAhead) {
    test::executor();
    gl::Transfers transfers(GetParam());
    gl::TexturePool pool;
    const gl::Texture* texture = test::must(pool.acquire({Format::rg32f, 3, 2, 40}));
    const ImageF pixels = test::noise_image(3, 2 * 40, 2, 1);
    gl::Upload upload{texture, &pixels};
    while (transfers.advance(upload)) EXPECT_EQ(upload.row % 2, 0);
    EXPECT_GE(upload.row, 2 * 32);
    EXPECT_EQ(test::error_of(transfers.finish(upload)), "");
    EXPECT_EQ(test::must(transfers.download(texture->name, *texture)), pixels);
}

TEST_P(Transfers, AnImageThatDoesNotFitIsRefused) {
    test::executor();
    gl::Transfers transfers(GetParam());
    gl::TexturePool pool;
    const gl::Texture* texture = test::must(pool.acquire({Format::rg32f, 4, 4, 0}));
    EXPECT_FALSE(transfers.upload(*texture, ImageF(4, 4, 1)).ok());
    EXPECT_FALSE(transfers.upload(*texture, ImageF(4, 5, 2)).ok());
}

TEST(TexturePool, GivesATextureAgainIfItIsFreeAndTheSame) {
    test::executor();
    gl::TexturePool pool;
    gl::Texture* const first = test::must(pool.acquire({Format::rg32f, 4, 5, 2}));
    EXPECT_NE(test::must(pool.acquire({Format::rg32f, 4, 5, 2})), first) << "in use";
    pool.release(first);
    const struct {
        Format format;
        int width, height, slices;
        bool apart, same;
    } cases[] = {{Format::rg32f, 4, 5, 2, true, true},   {Format::rg16f, 4, 5, 2, false, false},
                 {Format::rg32f, 3, 5, 2, false, false}, {Format::rg32f, 4, 4, 2, false, false},
                 {Format::rg32f, 4, 5, 3, false, false}, {Format::rg32f, 4, 5, 0, false, false}};
    for (const auto& [format, width, height, slices, apart, same] : cases) {
        gl::Texture* const given = test::must(pool.acquire({format, width, height, slices}, apart));
        EXPECT_EQ(given == first, same) << name_of(format) << width << height << slices;
        pool.release(given);
    }
    first->plans = 1;
    EXPECT_NE(test::must(pool.acquire({Format::rg32f, 4, 5, 2}, true)), first) << "a plan has it";
    for (const char* run : {"first", "second"}) {
        ASSERT_EQ(test::must(pool.acquire({Format::rg32f, 4, 5, 2})), first) << run;
        pool.release(first);
    }
}

TEST(TexturePool, KeepsTheTexturesOfPlans) {
    test::executor();
    gl::TexturePool pool;
    gl::Texture* const texture = test::must(pool.acquire({Format::r32f, 4, 4, 0}));
    pool.release(texture);
    texture->plans = 1;
    for (int frame = 0; frame < 5; ++frame) pool.begin_frame();
    pool.trim(3);
    EXPECT_EQ(pool.alive(), 1u);
    texture->plans = 0;
    pool.trim(3);
    EXPECT_EQ(pool.alive(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Transfers, Transfers, testing::Bool(), [](const auto& software) {
    return std::string(software.param ? "PlainMemory" : "Buffers");
});

}  // namespace
}  // namespace postchain
