// The tables of random numbers: values by hand, equal on GPU and CPU, evenly distributed,
// independent.

#include "passes/common/noise.h"

#include <array>
#include <cmath>
#include <set>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

using noise::Kind;

ImageF gpu_table(const std::string& noise, int64_t seed = 0) {
    BlurFrame frame(4, 4);
    return stages_of(blur({{"noise", noise}, {"seed", seed}}), frame)["noise"];
}

TEST(Noise, HaltonByHand) {
    const ImageF table = gpu_table("halton");
    expect_pixel(table, 0, 0, {0, -1}, 1e-6);
    expect_pixel(table, 1, 0, {0.5, 2.0 / 3 - 1}, 1e-6);     // index 1
    expect_pixel(table, 0, 1, {0.25, 4.0 / 3 - 1}, 1e-6);    // index 2
    expect_pixel(table, 1, 1, {0.75, 2.0 / 9 - 1}, 1e-6);    // index 3 = 10 in base 3
    expect_pixel(table, 2, 0, {0.125, 8.0 / 9 - 1}, 1e-6);   // index 4 = 100b = 11 in base 3
    expect_pixel(table, 127, 127, {16383.0 / 16384}, 1e-6);  // fourteen ones
}

TEST(Noise, GradientNoiseByHand) {
    const ImageF table = gpu_table("ign");
    const auto ign = [](double x, double y) {
        const double inner = 0.06711056 * x + 0.00583715 * y;
        const double outer = 52.9829189 * (inner - std::floor(inner));
        return outer - std::floor(outer);
    };
    for (auto [x, y] : {std::pair(0, 0), {1, 0}, {0, 1}, {17, 5}, {127, 127}})
        expect_pixel(table, x, y, {ign(x, y), 2 * ign(y + 37, x + 11) - 1}, 1e-5);
}

// Shifted differently along x and y.
TEST(Noise, TablesOfGpuAndCpuAreEqual) {
    for (const Kind kind : {Kind::halton, Kind::ign, Kind::blue}) {
        noise::Parameters parameters;
        parameters.noise = kind;
        parameters.seed = 99;
        const char* names[] = {"halton", "ign", "blue"};
        const char* name = names[size_t(kind)];
        EXPECT_LE(compare(gpu_table(name, 99), noise::table(parameters, 0), 0).max, 1e-6) << name;
    }
}

// Averages over 4 x 4 pixels of white noise have variance 1/12/16; of blue noise far less, because
// it lacks low frequencies. Measured 0.0003.
TEST(Noise, BlueHasNoLowFrequencies) {
    const ImageF table = gpu_table("blue");
    for (int channel : {0, 1}) {
        double variance = 0;
        for (int by = 0; by < 16; ++by) {
            for (int bx = 0; bx < 16; ++bx) {
                double mean = 0;
                for (int y = 0; y < 4; ++y)
                    for (int x = 0; x < 4; ++x)
                        mean += table.at(4 * bx + x, 4 * by + y, channel) / 16.0;
                const double value = channel == 0 ? mean : (mean + 1) / 2;
                variance += (value - 0.5) * (value - 0.5) / 256;
            }
        }
        EXPECT_LT(variance, 0.2 / 12 / 16) << channel;
    }
}

TEST(Noise, SpreadAndIndependent) {
    for (const char* name : {"halton", "ign", "blue"}) {
        const ImageF table = gpu_table(name, 5);
        std::vector<int> cells(64, 0);
        double product = 0;
        for (int y = 0; y < 128; ++y) {
            for (int x = 0; x < 128; ++x) {
                const double tile = table.at(x, y, 0), tap = table.at(x, y, 1);
                ASSERT_TRUE(tile >= 0 && tile < 1 && tap >= -1 && tap < 1) << name;
                ++cells[size_t(int(tile * 8) * 8 + int((tap + 1) * 4))];
                product += (tile - 0.5) * tap / 16384;
            }
        }
        // 256 pairs in each of 8 x 8 cells; five standard deviations of a random table are 80.
        for (int count : cells) EXPECT_NEAR(count, 256, 80) << name;
        // Correlation: product over the standard deviations sqrt(1/12) and sqrt(1/3).
        EXPECT_LT(std::abs(product) * 6, 0.03) << name;
    }
}

TEST(Noise, ShiftsWithSeedAndFrame) {
    noise::Parameters p;
    EXPECT_EQ(noise::shift_of(p, 7), (std::array<int, 2>{0, 0}));
    p.animate_noise = true;
    EXPECT_NE(noise::shift_of(p, 7), noise::shift_of(p, 8));
    EXPECT_EQ(noise::shift_of(p, 0), (std::array<int, 2>{0, 0}));
    const auto seventh = noise::shift_of(p, 7);
    p.seed = 1;
    EXPECT_NE(noise::shift_of(p, 7), seventh) << "renders of two seeds are averaged";
    p.animate_noise = false;
    EXPECT_NE(noise::shift_of(p, 7), (std::array<int, 2>{0, 0}));
    EXPECT_EQ(noise::shift_of(p, 7), noise::shift_of(p, 8));
}

// Neither a float's 24 bits nor the sign decide: 10,000 frames anywhere have as many patterns as
// 10,000 random choices of the 16,384, and no more stay for two frames than by chance: 0.6 of
// 10,000.
TEST(Noise, LongRunsDoNotRepeat) {
    noise::Parameters p;
    p.animate_noise = true;
    for (const int64_t first :
         {int64_t(0), (int64_t(1) << 24) - 5000, (int64_t(1) << 31) - 10000}) {
        std::set<std::array<int, 2>> found;
        size_t kept = 0;
        for (int64_t frame = first; frame < first + 10000; ++frame) {
            const auto shift = noise::shift_of(p, int(frame));
            found.insert(shift);
            kept += frame > first && shift == noise::shift_of(p, int(frame - 1));
        }
        // 16384 (1 - exp(-10000/16384)); five standard deviations are 225.
        EXPECT_NEAR(double(found.size()), 7485, 225) << first;
        EXPECT_LE(kept, 5u) << first;
    }
}

}  // namespace
}  // namespace postchain::test
