// uniform_blocks: the one rule that changes bits, and how far at most.
#include <algorithm>
#include <cmath>

#include "passes/motion_blur/motion_blur.h"
#include "tests/elision/support.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

// docs/motion_blur.md: part of the range of the colors within reach of taps.
constexpr double kBound = 1e-3;

struct Deviation {
    double worst = 0;  // as a part of the range nearby
    std::string text;
    size_t changed = 0;  // pixels
};

Deviation deviation(const ImageF& color, const ImageF& complete, const ImageF& elided, int reach) {
    Deviation result;
    for (int y = 0; y < complete.height; ++y)
        for (int x = 0; x < complete.width; ++x)
            for (int c = 0; c < complete.channels; ++c) {
                const double off =
                    std::abs(double(complete.at(x, y, c)) - double(elided.at(x, y, c)));
                if (off == 0) continue;
                ++result.changed;
                float low = color.at(x, y, c), high = low;
                for (int j = std::max(0, y - reach); j <= std::min(complete.height - 1, y + reach);
                     ++j)
                    for (int i = std::max(0, x - reach);
                         i <= std::min(complete.width - 1, x + reach); ++i) {
                        low = std::min(low, color.at(i, j, c));
                        high = std::max(high, color.at(i, j, c));
                    }
                const double part = off / std::max(double(high) - double(low), 1e-30);
                if (part <= result.worst) continue;
                result.worst = part;
                result.text = concat("at ", x, ",", y, " channel ", c, ": ", complete.at(x, y, c),
                                     " in complete, ", elided.at(x, y, c),
                                     " elided, colors nearby ", low, " .. ", high);
            }
    return result;
}

struct Case {
    int64_t r = 16, samples = 25;
    double kappa = 40, slope = 1, jitter = 0.95, softness = 1, gamma = 1.5;
    std::string mode = "guertin", split = "even", border = "skip", still = "perpendicular";
    Chain chain(int seed) const {
        return chain_of("motion_blur", {{"mode", "guertin"},
                                        {"shutter_frames", 2.0},  // motion is half-velocity
                                        {"max_blur_px", r},
                                        {"samples", samples},
                                        {"center_weight", kappa},
                                        {"tile_jitter_slope", slope},
                                        {"jitter", jitter},
                                        {"depth_softness", softness},
                                        {"variance_threshold_px", gamma},
                                        {"mode", mode},
                                        {"sample_split", split},
                                        {"border", border},
                                        {"static_direction", still},
                                        {"noise", "ign"s},
                                        {"seed", int64_t(seed)}});
    }
};

struct Total {
    unsigned uniform = 0, blocks = 0;
    size_t changed = 0;

    void add(const Case& one, const FramePlanes& planes, int seed) {
        SCOPED_TRACE(concat("seed ", seed));
        const FrameDescription frame = describe(planes);
        const Chain chain = one.chain(seed);
        const FramePlanes complete = filter(chain, frame, planes, no_rule());
        const FramePlanes elided =
            filter(chain, frame, planes, only({motion_blur::kRuleUniformBlocks}));
        for (const auto& done : executor().work_done()) {
            if (done.list.ends_with(".uniform_blocks")) uniform += done.blocks;
            blocks += done.blocks;
        }
        const Deviation off = deviation(planes.at(Role::color), complete.at(Role::color),
                                        elided.at(Role::color), int(one.r) + 1);
        changed += off.changed;
        EXPECT_LE(off.worst, kBound) << off.text << "\n" << chain.text();
    }
};

struct Layers {
    std::array<float, 2> motion;
    double spread;  // of motions, as a part of their length
    double depths;  // of depths, as a part of the smallest
};

FramePlanes layered(int width, int height, const Layers& layers, uint32_t seed) {
    FramePlanes planes;
    // Noise of black and white: the range of the colors nearby is the least it can be.
    planes[Role::color] = noise_image(width, height, 4, seed);
    for (float& value : planes[Role::color].data) value = value < 0.5f ? 0 : 1;
    planes[Role::inverse_depth] = constant_image(width, height, {0.25f});
    planes[Role::motion] = constant_image(width, height, {layers.motion[0], layers.motion[1]});
    const ImageF noise = noise_image(width, height, 3, seed + 1);
    const double length = std::hypot(layers.motion[0], layers.motion[1]);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            // A disc of motions: corners of its square would be farther apart.
            const double angle = 6.2831853 * noise.at(x, y, 0);
            const double off =
                0.5 * layers.spread * length * (noise.at(x, y, 1) < 0.7f ? 0.999 : 0.5);
            planes[Role::motion].at(x, y, 0) += float(off * std::cos(angle) * 0.707);
            planes[Role::motion].at(x, y, 1) += float(off * std::sin(angle) * 0.707);
            if (noise.at(x, y, 2) < 0.5f)
                planes[Role::inverse_depth].at(x, y) *= float(1 + layers.depths);
        }
    return planes;
}

TEST(UniformTiles, UpToTheLimits) {
    Total total;
    int seed = 100;
    for (const char* mode : {"guertin", "single"})
        for (const char* split : {"even", "variance"})
            for (const int64_t samples : {5, 25})
                for (const double speed : {0.6, 7.0, 15.5}) {
                    Case one;
                    one.mode = mode;
                    one.split = split;
                    one.samples = samples;
                    one.kappa = std::array{0.1, 40.0, 10000.0}[size_t(seed) % 3];
                    one.still = seed % 2 ? "dominant" : "perpendicular";
                    one.border = seed % 2 ? "skip" : "clamp";
                    one.softness = seed % 3 ? 1.0 : 20.0;
                    one.gamma = seed % 2 ? 1.5 : 0.05;
                    one.slope = seed % 4 < 2 ? 0 : 1;
                    const Layers layers{
                        {float(speed * 0.8), float(-speed * 0.6)}, 2.4e-4, 2.4e-4 / one.softness};
                    ++seed;
                    total.add(one, layered(49, 35, layers, uint32_t(seed)), seed);
                }
    EXPECT_GT(total.uniform, total.blocks / 2);
    EXPECT_GT(total.changed, 0u);
}

// Beyond the limits a block is not uniform.
TEST(UniformTiles, NotAboveTheLimits) {
    Total total;
    for (const Layers& layers : {Layers{{9, 3}, 2e-3, 0}, {{9, 3}, 0, 2.6e-4}})
        total.add({}, layered(71, 50, layers, 5), 5);
    EXPECT_EQ(total.uniform, 0u);
}

// A fast mover is the dominant motion of pixels that choose the tile across a border, two tiles
// from it: farther than taps reach. It must not make slow neighbors that differ look alike.
TEST(UniformTiles, AFastMoverTwoTilesAway) {
    Total total;
    int seed = 200;
    for (const int64_t r : {17, 32})
        for (const double speed : {0.55, 4.0})
            for (const int64_t samples : {5, 25})
                for (const double slope : {0.0, 1.0}) {
                    Case one;
                    one.r = r;
                    one.samples = samples;
                    one.slope = slope;
                    one.jitter = 1;
                    const int width = int(4 * r), height = 40;
                    const Layers layers{{float(speed * 0.8), float(speed * 0.6)},
                                        0.9 * 2.5e-4 * double(r) / speed,
                                        0};
                    FramePlanes planes = layered(width, height, layers, uint32_t(++seed));
                    for (int y = 0; y < height; ++y) {  // the third column of tiles
                        planes[Role::motion].at(2 * int(r) + 1, y, 0) = float(r);
                        planes[Role::motion].at(2 * int(r) + 1, y, 1) = 0;
                    }
                    total.add(one, planes, seed);
                }
}

}  // namespace
}  // namespace postchain::test
