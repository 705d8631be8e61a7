// Each tile stage against pixels computed by hand. Shutter 0.5 unless stated: v = motion / 4.

#include <cmath>
#include <fstream>
#include <glm/gtc/packing.hpp>
#include <limits>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

TEST(HalfVelocity, ByHand) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    BlurFrame frame(10, 1);
    const float motion[10][2] = {
        {4, 0},    {0, -8},   {60, 80},      {-120, 0},         {0, 0},
        {40, -40}, {kNan, 4}, {4, INFINITY}, {-INFINITY, kNan}, {0, -1e30f}};
    for (int x = 0; x < 10; ++x)
        for (int c = 0; c < 2; ++c) frame.motion().at(x, 0, c) = motion[x][c];
    const Chain chain = plain_blur({{"max_blur_px", int64_t(10)}, {"velocity_storage", "fp32"}});
    const ImageF v = stages_of(chain, frame)["half_velocity"];
    expect_pixel(v, 0, 0, {1, 0});
    expect_pixel(v, 1, 0, {0, -2});
    expect_pixel(v, 2, 0, {6, 8});    // (15, 20), length 25, times 10/25
    expect_pixel(v, 3, 0, {-10, 0});  // -30 -> -10
    expect_pixel(v, 4, 0, {0, 0});
    const double side = 10 / std::sqrt(2.0);  // (10, -10), length 14.14, stays on its diagonal
    expect_pixel(v, 5, 0, {side, -side});
    for (const int x : {6, 7, 8}) expect_pixel(v, x, 0, {0, 0});  // no vectors
    expect_pixel(v, 9, 0, {0, -10});
    EXPECT_LE(compare(v, reference_stages_of(chain, frame).at("half_velocity"), 1e-5).max, 1e-5);
}

TEST(HalfVelocity, StorageByHand) {
    BlurFrame frame(5, 1);
    frame.set_half_velocity(0, 0, 1, 0);
    frame.set_half_velocity(1, 0, -10, 0);
    frame.set_half_velocity(2, 0, 0.001, 3.0009765625);
    frame.set_half_velocity(3, 0, 5, -0.03);
    const auto stored = [&](const char* storage) {
        const Chain chain =
            plain_blur({{"max_blur_px", int64_t(10)}, {"velocity_storage", storage}});
        return stages_of(chain, frame)["half_velocity"];
    };
    // code = 128 + round(127 v / 10): 12.7 -> 141; -127 -> 1; 0.0127 -> 128, 38.112 -> 166;
    // 63.5 -> 64 (to even) -> 192, -0.381 -> 128
    ImageF v = stored("unorm8");
    expect_pixel(v, 0, 0, {141 / 255.0, 128 / 255.0}, 1e-6);
    expect_pixel(v, 1, 0, {1 / 255.0, 128 / 255.0}, 1e-6);
    expect_pixel(v, 2, 0, {128 / 255.0, 166 / 255.0}, 1e-6);
    expect_pixel(v, 3, 0, {192 / 255.0, 128 / 255.0}, 1e-6);
    expect_pixel(v, 4, 0, {128 / 255.0, 128 / 255.0}, 1e-6);
    // 11 bits: 3.0009765625 = 3 + 2^-10 is half-way between 3 and 3 + 2^-9: to even, 3.
    // 0.001 = 1.024 * 2^-10 -> 1049/1024 * 2^-10 (1048.576 rounded)
    v = stored("fp16");
    expect_pixel(v, 2, 0, {1049.0 / 1024 / 1024, 3}, 1e-9);
    expect_pixel(v, 0, 0, {1, 0}, 0);
}

// 7 x 5 pixels in tiles of 3: 3 x 2 tiles, the last column one pixel wide, the last row two high.
TEST(TileMax, ByHand) {
    BlurFrame frame(7, 5);
    frame.set_half_velocity(0, 0, 1, 0);
    frame.set_half_velocity(2, 2, 0, -2);   // longest of tile 0,0
    frame.set_half_velocity(3, 0, 0, 1.5);  // tile 1,0: three of equal length, in three rows ...
    frame.set_half_velocity(5, 1, 1.5, 0);
    frame.set_half_velocity(4, 2, -1.5, 0);
    frame.set_half_velocity(6, 1, 30, 40);  // tile 2,0: clamped to 3 px
    frame.set_half_velocity(6, 0, -3, 0);
    frame.set_half_velocity(6, 2, -30, 39);
    frame.set_half_velocity(2, 3, 2, 0);  // tile 0,1: equal in one row: the left one
    frame.set_half_velocity(1, 3, -2, 0);
    frame.set_half_velocity(6, 3, 0, 0.25);  // tile 2,1: both pixels move
    frame.set_half_velocity(6, 4, 0.5, 0);
    auto stages = stages_of(plain_blur({{"max_blur_px", int64_t(3)}}), frame);
    const ImageF& tiles = stages["tile_max"];
    ASSERT_EQ(tiles.width, 3);
    ASSERT_EQ(tiles.height, 2);
    // v, squared length before the clamp, smallest |v|
    expect_pixel(tiles, 0, 0, {0, -2, 4, 0});
    expect_pixel(tiles, 1, 0, {0, 1.5, 2.25, 0});  // ... the first row wins
    expect_pixel(tiles, 2, 0, {1.8, 2.4, 2500, 3});
    expect_pixel(tiles, 0, 1, {-2, 0, 4, 0});
    expect_pixel(tiles, 1, 1, {0, 0, 0, 0});
    expect_pixel(tiles, 2, 1, {0.5, 0, 0.25, 0.25});
}

// 15 x 9 pixels, tiles of 3 with one velocity each.
struct TileFrame : BlurFrame {
    TileFrame() : BlurFrame(15, 9) {}
    void set_tile(int i, int j, double vx, double vy) {
        for (int y = 3 * j; y < 3 * j + 3; ++y)
            for (int x = 3 * i; x < 3 * i + 3; ++x) set_half_velocity(x, y, vx, vy);
    }
    ImageF stage(const char* name) const {
        const Values values = {{"max_blur_px", int64_t(3)}, {"sample_split", "variance"}};
        return stages_of(plain_blur(values), *this)[name];
    }
};

TEST(NeighborMax, ByHand) {
    TileFrame frame;
    // Tile 1,1 is diagonal (+1, +1) to 0,0 and (-1, +1) to 2,0.
    frame.set_tile(1, 1, 1, 1);
    frame.set_tile(0, 1, 0.5, 0);
    frame.set_tile(4, 0, 0, 1);
    frame.set_tile(4, 2, -2, 1);
    const ImageF out = frame.stage("neighbor_max");
    expect_pixel(out, 0, 0, {1, 1, 2, 0});       // diagonal, along it: counts (beats 0.5 below)
    expect_pixel(out, 2, 0, {0, 0, 0, 0});       // diagonal, across it: does not count
    expect_pixel(out, 0, 1, {1, 1, 2, 0});       // on-axis: always
    expect_pixel(out, 2, 2, {1, 1, 2, 0});       // (-1, -1) of 2,2: two-sided, counts
    expect_pixel(out, 0, 2, {0.5, 0, 0.25, 0});  // across (1,1); above it moves
    // Offset (1, 1) of (-2, 1): signs differ. Offset (1, -1) of (0, 1): one sign is zero.
    expect_pixel(out, 3, 1, {0, 0, 0, 0});
    expect_pixel(out, 4, 1, {-2, 1, 5, 0});  // both on-axis: the longer
}

TEST(NeighborMax, TiesTakeTheCenterThenRowOrder) {
    TileFrame frame;
    frame.set_tile(1, 0, 0, 2);   // above the center of 1,1
    frame.set_tile(0, 1, 2, 0);   // left of it
    frame.set_tile(2, 1, -2, 0);  // right of it
    expect_pixel(frame.stage("neighbor_max"), 1, 1, {0, 2, 4, 0});
    frame.set_tile(1, 1, 0, -2);
    expect_pixel(frame.stage("neighbor_max"), 1, 1, {0, -2, 4, 0});
}

TEST(NeighborMax, ComparesLengthsBeforeTheClamp) {
    TileFrame frame;
    frame.set_tile(1, 1, 300, 0);
    frame.set_tile(2, 1, 0, 301);
    const ImageF out = frame.stage("neighbor_max");
    expect_pixel(out, 1, 1, {0, 3, 301.0 * 301.0, 0});
    expect_pixel(out, 0, 1, {3, 0, 90000, 0});
}

// The widest and the highest frame, tiles of a pixel, and a tile wider than the frame.
TEST(NeighborMax, EqualsTheReferenceInTilesOfAnySize) {
    for (const auto& [width, height, tile] :
         {std::tuple(16384, 3, 40), {3, 16384, 40}, {16384, 2, 1}, {33, 20, 1024}}) {
        const BlurFrame frame = random_frame(width, height, 14, 2, 5);
        const Chain chain = blur({{"max_blur_px", int64_t(tile)}, {"samples", int64_t(3)}});
        const auto gpu = stages_of(chain, frame);
        const auto expected = reference_stages_of(chain, frame);
        for (const char* name : {"tile_max", "neighbor_max", "color"}) {
            const Difference difference = compare(gpu.at(name), expected.at(name), 1e-4);
            EXPECT_LE(difference.fraction, 0.002)
                << width << "x" << height << " " << name << ": " << difference.text;
        }
    }
}

TEST(TileVariance, ByHand) {
    TileFrame frame;  // 5 x 3 tiles
    frame.set_tile(0, 0, 2, 0);
    frame.set_tile(1, 0, 1.2, 1.6);  // n = (0.6, 0.8)
    frame.set_tile(0, 1, 0.3, 0);    // slower than 0.5 px: no direction
    frame.set_tile(4, 0, 1, 1);
    frame.set_tile(4, 1, -1, 1);
    frame.set_tile(3, 0, -2, -2);
    frame.set_tile(2, 2, 3, 0);
    const ImageF u = frame.stage("tile_variance");
    // Neighbors that move, itself included; |n . n'|:
    expect_pixel(u, 0, 0, {1 - (1 + 0.6) / 2});      // itself 1, the tile to the right 0.6
    expect_pixel(u, 0, 1, {0});                      // slow: still
    expect_pixel(u, 2, 1, {0});                      // still
    expect_pixel(u, 2, 2, {0});                      // only itself: |n . n| = 1
    expect_pixel(u, 3, 0, {1 - (1 + 1 + 0) / 3.0});  // (-1,-1) is parallel to (1,1), across (-1,1)
    expect_pixel(u, 4, 0, {1 - (1 + 0 + 1) / 3.0});
    expect_pixel(u, 4, 1, {1 - (0 + 1 + 0) / 3.0});
}

// An independent double-precision implementation of the definitions, on a path-traced image.
//
// tests/data/motion_blur/wheels_crop.bin is a crop of 160 x 160 pixels on tile borders: color (half
// RGB), inverse depth and motion; and of the inner 80 x 80 pixels, which do not depend on pixels
// outside the crop, the results of modes guertin and single (float RGB). A text header ends in a
// line "end"; planes follow in the header's order, rows of little-endian numbers. N = 25, r = 40,
// shutter 0.5, s = 1, kappa = 40, no jitter.

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
