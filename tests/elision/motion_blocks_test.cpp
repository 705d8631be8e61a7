// still_blocks, sky_blocks and unhinted_blocks: blocks that motion blur and FXAA sort out on the
// device.

#include "chain/pass/work_list.h"
#include "passes/fxaa/fxaa.h"
#include "passes/motion_blur/motion_blur.h"
#include "tests/elision/support.h"

namespace postchain::test::motion_blocks_test {
namespace {

using namespace std::string_literals;

constexpr std::pair<int, int> kSizes[] = {{1, 1}, {1, 97}, {89, 1}, {5, 3}, {17, 15}, {61, 53}};

// Motion is half-velocity: the shutter is open for two frames.
struct Blur {
    int64_t max_blur_px = 16;
    int64_t samples = 9;
    double slope = 1;
    int64_t seed = 0;
    std::string storage = "auto";
};

Chain chain_of(const Blur& blur) {
    return test::chain_of("motion_blur", {{"mode", "guertin"},
                                          {"shutter_frames", 2.0},
                                          {"max_blur_px", blur.max_blur_px},
                                          {"samples", blur.samples},
                                          {"tile_jitter_slope", blur.slope},
                                          {"jitter", 1.0},
                                          {"noise", "ign"s},
                                          {"seed", blur.seed},
                                          {"velocity_storage", blur.storage}});
}

struct Scene {
    FramePlanes planes;
    Scene(int width, int height, uint32_t seed, std::array<float, 2> motion = {0, 0},
          float depth = 0.1f)
        : planes(flat_planes(half_noise(width, height, 4, seed), motion, depth)) {}
    void move(int x, int y, float vx, float vy) {
        planes[Role::motion].at(x, y, 0) = vx;
        planes[Role::motion].at(x, y, 1) = vy;
    }
    float& depth(int x, int y) { return planes[Role::inverse_depth].at(x, y); }
    // The hint too: it tells of every choice of a tile, also where no tap finds another color.
    Elided check(const Blur& blur, const std::string& rule, Precision precision) const {
        PlanOptions options = only({rule}, precision);
        options.outputs.add(Role::hint);
        return expect_same_bits(chain_of(blur), describe(planes), planes, options);
    }
};

// The whole frame moves at one speed, a few floats on either side of what counts as still: 0.5 px
// by the facts, and with what storing a velocity can add on the device.
TEST(StillTiles, SpeedsAroundTheLimit) {
    const std::pair<const char*, float> limits[] = {
        {"fp32", 0.5f},
        {"fp32", 0.5f * (1 + 0x1p-20f)},
        {"fp16", 0.5f},
        {"fp16", 0.5f * (1 + 0x1p-10f) + 0x1p-24f},
        {"unorm8", 0.5f},  // codes are 16/127 = 0.126 px apart
        {"unorm8", 0.5f * (1 + 0x1p-20f) + 0.70711f * 16 / 127}};
    const std::array<float, 2> directions[] = {
        {1, 0}, {0, -1}, {0.6f, 0.8f}, {-0.70710678f, 0.70710678f}};
    int still = 0, moving = 0;
    for (const auto& [storage, limit] : limits)
        for (const int steps : {-1000, -2, -1, 0, 1, 2, 1000})
            for (const auto& d : directions) {
                const float speed = neighbor(limit, steps);
                const Precision precision = kPrecisions[steps & 1];
                SCOPED_TRACE(concat(name_of(precision), " ", storage, " ", limit, " ", steps,
                                    " steps along ", d[0], ",", d[1]));
                const Scene scene(37, 21, 3, {speed * d[0], speed * d[1]});
                Blur blur;
                blur.storage = storage;
                const Elided elided = scene.check(blur, motion_blur::kRuleStillBlocks, precision);
                // 3 x 2 blocks, one speed: all or none.
                const unsigned blocks = elided.blocks("still_blocks");
                EXPECT_EQ(elided.blocks("full_blocks"), 6 - blocks);
                EXPECT_TRUE(blocks == 6 || (blocks == 0 && speed >= 0.4999f)) << blocks;
                EXPECT_TRUE(blocks == 0 || speed <= 0.68f) << blocks;
                (blocks ? still : moving) += 1;
            }
    EXPECT_GT(still, 50);
    EXPECT_GT(moving, 20);
}

// One pixel moves, at every offset against the blocks and against tiles of many sizes. Slope 0 lets
// pixels choose the tile across a border from half a tile away.
TEST(StillTiles, OneMoverAtEveryOffset) {
    unsigned still = 0, full = 0;
    for (const int r : {1, 3, 8, 15, 16, 17, 31, 50}) {
        // The mover reaches three tiles each way, and half a tile further by the jitter.
        const int width = 5 * r + 70, height = 2 * r + 40;
        const int offsets = std::max(16, r);
        for (int k = 0; k<offsets; k += r> 24 ? 7 : r == 16 || r == 17 ? 1 : 3) {
            Blur blur;
            blur.max_blur_px = r;
            blur.seed = 31 * k + r;
            blur.slope = std::array{1.0, 0.0, 1.0, 0.7, 3.0}[size_t(k) % 5];
            Scene scene(width, height, uint32_t(r + 100 * k));
            const float speed = k % 3 ? float(r) : 0.51f;
            const int x = 2 * r + 16 + k, y = (16 + 5 * k) % height;
            scene.move(x, y, k % 2 ? speed : 0.8f * speed, k % 2 ? 0 : 0.6f * speed);
            const Precision precision = kPrecisions[size_t(k / 4) % 2];
            SCOPED_TRACE(concat("r ", r, ", mover at ", x, ",", y, ", slope ", blur.slope, " ",
                                name_of(precision)));
            const Elided elided = scene.check(blur, motion_blur::kRuleStillBlocks, precision);
            EXPECT_GT(elided.blocks("full_blocks"), 0u);
            still += elided.blocks("still_blocks");
            full += elided.blocks("full_blocks");
        }
    }
    EXPECT_GT(still, full / 2);
}

TEST(StillTiles, SmallAndOddSizes) {
    unsigned still = 0;
    for (const auto& [width, height] : kSizes)
        for (const int r : {1, 16, 41})
            for (const bool moves : {false, true}) {
                const Precision precision = kPrecisions[moves];
                SCOPED_TRACE(concat(width, "x", height, " r ", r, " ", name_of(precision)));
                Blur blur;
                blur.max_blur_px = r;
                blur.slope = 0;
                Scene scene(width, height, uint32_t(width + 7 * height));
                if (moves) scene.move(width - 1, height / 2, float(r) / 2 + 0.25f, -0.5f);
                const Elided elided = scene.check(blur, motion_blur::kRuleStillBlocks, precision);
                const auto groups = groups_for(width, height);
                const unsigned left = elided.blocks("still_blocks");
                const unsigned full = elided.blocks("full_blocks");
                EXPECT_EQ(left + full, unsigned(groups[0] * groups[1]));
                EXPECT_TRUE(moves || full == 0) << full;
                still += left;
            }
    EXPECT_GT(still, 20u);
}

// Everything moves; one pixel of another depth stands at every offset against blocks and tiles. A
// tap that reaches it from a sky block, whose depths are not compared, would weigh it wrongly.
TEST(SkyTiles, OneDepthInTheSkyAtEveryOffset) {
    unsigned sky = 0, full = 0;
    for (const int r : {1, 3, 7, 15, 16, 17, 33}) {
        const int width = 4 * r + 66, height = 34;
        const int offsets = std::max(16, r);
        for (int k = 0; k<offsets; k += r> 20 ? 5 : r == 16 || r == 17 ? 1 : 3) {
            Blur blur;
            blur.max_blur_px = r;
            blur.samples = std::min(2 * r + 3, 41);
            blur.seed = k;
            const bool across = k % 3 == 2;
            const float speed = 4.0f * float(r);  // clamped to r
            const std::array<float, 2> motion =
                k % 3 == 0 ? std::array{speed, 0.0f} : std::array{-speed, across ? speed : 0.1f};
            Scene scene(width, height, uint32_t(k), motion, 0);
            const int x = 2 * r + 16 + k, y = (3 + 7 * k) % height;
            scene.depth(x, y) = k % 2 ? 0.3f : 1e-30f;
            scene.planes[Role::color].at(x, y, 1) = 60;
            const Precision precision = kPrecisions[size_t(k / 3) % 2];
            SCOPED_TRACE(concat("r ", r, ", ground at ", x, ",", y, " ", name_of(precision)));
            const Elided elided = scene.check(blur, motion_blur::kRuleSkyBlocks, precision);
            EXPECT_GT(elided.blocks("full_blocks"), 0u);
            sky += elided.blocks("sky_blocks");
            full += elided.blocks("full_blocks");
        }
    }
    EXPECT_GT(sky, full / 2);
}

// One depth everywhere is as good as the sky. If the bounds say so, no block is sorted, and no
// depth is read; where no fact is known the device finds it.
TEST(SkyTiles, AFrameOfOneDepth) {
    Scene scene(48, 32, 5, {6, 1}, 0);
    // As in an engine: no bounds are known.
    const auto sky_blocks_of_unknown = [&] {
        FrameDescription frame = describe(scene.planes);
        frame.bounds = FrameBounds();
        return expect_same_bits(chain_of(Blur()), frame, scene.planes,
                                only({motion_blur::kRuleSkyBlocks}))
            .blocks("sky_blocks");
    };
    for (const float w : {0.0f, 0.25f}) {
        for (float& value : scene.planes[Role::inverse_depth].data) value = w;
        const Elided elided = scene.check({}, motion_blur::kRuleSkyBlocks, Precision::fp32);
        EXPECT_EQ(elided.plan.steps.back().program.defines.at("DEPTH"), "0");
        for (const auto& step : elided.plan.steps) EXPECT_NE(step.name, "classify");
        EXPECT_EQ(sky_blocks_of_unknown(), 6u);
    }
    // Depths that differ in the last bit are two depths.
    scene.depth(40, 20) = neighbor(0.25f, 1);
    EXPECT_LT(sky_blocks_of_unknown(), 6u);
}

// FXAA where: blurred: single pixels with a hint, also in the last row and column and beside a
// border of blocks, whose lumas lie in another block.
TEST(UnhintedBlocks, PixelsAlone) {
    FramePlanes planes = flat_planes(half_noise(101, 67, 4, 5));
    ImageF& hint = planes[Role::hint] = ImageF(101, 67, 2);
    const std::pair<int, int> places[] = {{0, 0}, {47, 15}, {48, 32}, {100, 20}, {70, 66}};
    for (const auto& [x, y] : places) hint.at(x, y, 1) = 0.7f;
    hint.at(5, 50, 1) = NAN;
    for (const char* mode : {"search", "directional"})
        for (const bool layered : {false, true}) {
            SCOPED_TRACE(concat(mode, ", layered: ", layered));
            FramePlanes given = planes;
            if (layered) {  // which has half of the light
                given[Role::layers] = planes.at(Role::color);
                for (float& value : given[Role::layers].data) value /= 2;
            }
            const Elided elided = expect_same_bits(
                test::chain_of("fxaa", {{"mode", std::string(mode)}, {"where", "blurred"s}}),
                describe(given), given, only({fxaa::kRuleUnhintedBlocks}));
            EXPECT_EQ(elided.blocks("filtered_blocks"), 5u);
            EXPECT_EQ(elided.blocks("kept_blocks"), 7u * 5 - 5);
            int changed = 0;
            for (int y = 0; y < 67; ++y)
                for (int x = 0; x < 101; ++x)
                    changed +=
                        elided.outputs.at(Role::color).at(x, y) != planes.at(Role::color).at(x, y);
            EXPECT_EQ(changed, 5);
            for (size_t i = 0; layered && i < 4u * 101 * 67; ++i)
                ASSERT_NEAR(2 * elided.outputs.at(Role::layers).data[i],
                            elided.outputs.at(Role::color).data[i], 1e-6);
        }
}

}  // namespace
}  // namespace postchain::test::motion_blocks_test
