// focus_blocks: blocks of the depth of field sorted on the device, and of the blurred image only
// what is read.
#include <cmath>

#include "chain/pass/work_list.h"
#include "passes/depth_of_field/depth_of_field.h"
#include "tests/elision/support.h"

namespace postchain::test::focus_blocks_test {
namespace {

using namespace std::string_literals;

constexpr const char* kLeaks[] = {"none", "depth", "coc"};
constexpr int64_t kFactors[] = {1, 2, 4};

// Radius by distance: R = max_radius (d - 10) / 10 px, clamped; w = 1 / 10 is in focus.
Chain focus_chain(double max_radius_px, double sigma_px, int64_t factor, const std::string& leak) {
    return chain_of("depth_of_field", {{"method", "gilham"},
                                       {"coc", "range"s},
                                       {"focus", 10.0},
                                       {"range", 10.0},
                                       {"max_radius_px", max_radius_px},
                                       {"blur_sigma_px", sigma_px},
                                       {"downsample", factor},
                                       {"leak", leak}});
}

FramePlanes focused(int width, int height, uint32_t seed, float w = 0.1f) {
    return flat_planes(half_noise(width, height, 4, seed), {0, 0}, w);
}

Elided check(const Chain& chain, const FramePlanes& planes, Precision precision,
             RoleSet outputs = {Role::color}) {
    PlanOptions options = only({depth_of_field::kRuleFocusBlocks}, precision);
    options.outputs = outputs;
    const Elided elided = expect_same_bits(chain, describe(planes), planes, options);
    const auto groups = groups_for(elided.plan.width, elided.plan.height);
    EXPECT_EQ(elided.blocks("sharp_blocks") + elided.blocks("blurred_blocks") +
                  elided.blocks("mixed_blocks"),
              unsigned(groups[0] * groups[1]));
    return elided;
}

// The taps of a pixel decide which blocks of the downsampled image it needs: the one pixel out of
// focus is placed at every offset against these blocks.
TEST(FocusTiles, OneBlurredPixelAtEveryOffset) {
    unsigned copied = 0, all = 0;
    for (const int64_t factor : kFactors) {
        const int period = int(16 * factor);
        for (int k = 0; k < period; ++k) {
            const int width = 3 * period + 5, height = 3 * period - 3;
            FramePlanes planes = focused(width, height, uint32_t(k));
            const int x = period + k, y = period + (7 * k) % period;
            planes[Role::inverse_depth].at(x, y) = k % 2 ? 0.02f : 0.07f;  // R 6, R 2.6
            // Taps reach 1 to 48 pixels of the downsampled image.
            const double sigma =
                double(factor) * std::array{0.3, 1.2, 4.9, 5.4, 16.0}[size_t(k) % 5];
            const char* leak = kLeaks[size_t(k / 2) % 3];
            const Precision precision = kPrecisions[size_t(k / 6) % 2];
            SCOPED_TRACE(concat("downsample ", factor, ", pixel ", x, ",", y, ", sigma ", sigma,
                                " leak ", leak, " ", name_of(precision)));
            const Elided elided = check(focus_chain(6, sigma, factor, leak), planes, precision);
            EXPECT_EQ(elided.blocks("sharp_blocks"), unsigned(elided.work.at(0).of - 1));
            EXPECT_GT(elided.blocks("blur_y_blocks"), 0u);
            copied += elided.blocks("blur_y_blocks");
            for (const auto& one : elided.work)
                if (one.list.ends_with("blur_y_blocks")) all += one.of;
        }
    }
    EXPECT_LT(copied, all / 2);
}

// The whole frame at radii a few floats on either side of 0.5 px, where colors begin to change, and
// of max(2 sigma, 1) px, from which only the blurred image shows.
TEST(FocusTiles, RadiiAroundTheLimits) {
    unsigned sharp = 0, blurred = 0, mixed = 0;
    for (const Precision precision : kPrecisions)
        for (const double sigma : {0.5, 2.0, 3.3})
            for (const double limit : {0.5, std::max(2 * sigma, 1.0)})
                for (const double off :
                     {-1e-3, -4e-4, -1e-6, -1.2e-7, 0.0, 1.2e-7, 1e-6, 4e-4, 1e-3}) {
                    const double radius = limit * (1 + off);
                    // R = 16 (d - 10)/10
                    FramePlanes planes = focused(35, 19, 6, float(1 / (10 + 10 * radius / 16)));
                    const double near = 1 / (10 - 10 * radius / 16);
                    for (int x = 0; x < 35; x += 3)
                        planes[Role::inverse_depth].at(x, 7) = float(near);
                    SCOPED_TRACE(concat(name_of(precision), " sigma ", sigma, " radius ", radius));
                    const Elided elided =
                        check(focus_chain(16, sigma, 2, "coc"), planes, precision);
                    sharp += elided.blocks("sharp_blocks");
                    blurred += elided.blocks("blurred_blocks");
                    mixed += elided.blocks("mixed_blocks");
                    const auto expect_all_or_none = [&](const char* list, bool all, bool none) {
                        EXPECT_TRUE(!all || elided.blocks(list) == 6) << list;
                        EXPECT_TRUE(!none || elided.blocks(list) == 0) << list;
                    };
                    expect_all_or_none("sharp_blocks", (radius < 0.4999), (radius > 0.5001));
                    const double full_px = std::max(2 * sigma, 1.0);
                    expect_all_or_none("blurred_blocks", radius > 1.0012 * full_px,
                                       radius < 0.9999 * full_px);
                }
    EXPECT_GT(sharp, 50u);
    EXPECT_GT(blurred, 20u);
    EXPECT_GT(mixed, 100u);
}

// The Gaussian has other taps along x than along y: 9 and 36 pixels, or 36 and 9.
TEST(FocusTiles, PixelsOfAnotherShape) {
    FramePlanes planes = focused(117, 131, 8);
    planes[Role::inverse_depth].at(60, 66) = 0.02f;
    FrameDescription frame = describe(planes);
    for (const double aspect : {4.0, 0.25}) {
        SCOPED_TRACE(aspect);
        frame.pixel_aspect = aspect;
        const Elided elided =
            expect_same_bits(focus_chain(30, 12, 1, "none"), frame, planes,
                             only({depth_of_field::kRuleFocusBlocks}, Precision::fp32));
        EXPECT_EQ(elided.blocks("mixed_blocks"), 1u);
        EXPECT_EQ(elided.blocks("blur_x_blocks"), aspect > 1 ? 3 * 9u : 3 * 5u);
    }
}

// A largest radius of exactly full_blur_px, and a little above: what is clamped to it is wholly
// blurred.
TEST(FocusTiles, ClampedToFullBlur) {
    unsigned blurred = 0;
    for (const double sigma : {0.75, 2.0, 3.7})
        for (const double part : {1.0, 1.01})
            for (size_t k = 0; k < 3; ++k) {
                const Precision precision = kPrecisions[k % 2];
                FramePlanes planes = focused(49, 33, 2, 0.001f);
                for (int x = 0; x < 20; ++x) planes[Role::inverse_depth].at(x, 30) = 0.1f;
                SCOPED_TRACE(concat(name_of(precision), " sigma ", sigma, " ", part));
                const Chain chain = focus_chain(part * 2 * sigma, sigma, kFactors[k], kLeaks[k]);
                const Elided elided = check(chain, planes, precision);
                EXPECT_EQ(elided.blocks("sharp_blocks"), 0u);
                EXPECT_GE(elided.blocks("mixed_blocks"), 2u);
                EXPECT_TRUE(part == 1 || elided.blocks("mixed_blocks") == 2);
                blurred += elided.blocks("blurred_blocks");
            }
    EXPECT_GT(blurred, 75u);
}

TEST(FocusTiles, SmallAndOddSizes) {
    const std::pair<int, int> sizes[] = {{1, 1}, {97, 1}, {5, 7}, {17, 15}, {67, 31}};
    for (const auto& [width, height] : sizes)
        for (size_t k = width % 3; k < 3; k += 3)
            for (const int scene : {0, 1, 2}) {  // in focus, one corner blurred, all blurred
                FramePlanes planes = focused(width, height, 3, scene == 2 ? 0.03f : 0.1f);
                if (scene == 1) planes[Role::inverse_depth].at(width - 1, height - 1) = 1.0f;
                const Precision precision = kPrecisions[height % 2];
                SCOPED_TRACE(
                    concat(width, "x", height, " downsample ", kFactors[k], " scene ", scene));
                const Elided elided =
                    check(focus_chain(9, 3, kFactors[k], kLeaks[k]), planes, precision);
                const unsigned of = elided.work.at(0).of;
                const unsigned blurry = scene == 0 ? 0 : scene == 1 ? 1 : of;
                EXPECT_EQ(elided.blocks("sharp_blocks"), of - blurry);
                EXPECT_TRUE(scene > 0 || elided.blocks("small_blocks") == 0);
                EXPECT_TRUE(scene < 2 || elided.blocks("blurred_blocks") == of);
            }
}

// Every kind of block does to the hint what the whole composite does: times clamp(1 - |R|, 0, 1).
TEST(FocusTiles, TheHintIsCarried) {
    for (size_t k = 0; k < 3; ++k) {
        const Precision precision = kPrecisions[k % 2];
        FramePlanes planes = focused(83, 67, 4);
        planes[Role::hint] = noise_image(83, 67, 2, 12);
        for (int y = 0; y < 67; ++y)
            for (int x = 0; x < 83; ++x)
                planes[Role::inverse_depth].at(x, y) = x < 24   ? 0.0977f  // R 0.19
                                                       : y < 24 ? 0.02f
                                                                : 0.1f - 0.0003f * float(x % 16);
        const Chain chain = focus_chain(8, 1.5, kFactors[k], kLeaks[k]);
        const Elided elided = check(chain, planes, precision, {Role::color, Role::hint});
        EXPECT_TRUE(elided.outputs.count(Role::hint));
        EXPECT_GT(elided.blocks("sharp_blocks"), 2u);
        EXPECT_GT(elided.blocks("blurred_blocks"), 0u);
        EXPECT_GT(elided.blocks("mixed_blocks"), 2u);
    }
}

// The lens copies its blocks in focus, with their hint.
TEST(FocusTiles, TheHintIsCarriedByTheLens) {
    FramePlanes planes = focused(131, 67, 4);
    planes[Role::hint] = noise_image(131, 67, 2, 12);
    for (int y = 0; y < 67; ++y)
        for (int x = 90; x < 131; ++x) planes[Role::inverse_depth].at(x, y) = 0.05f;
    const Chain chain = chain_of("depth_of_field", {{"method", "inverse_warp"s},
                                                    {"coc", "range"s},
                                                    {"focus", 10.0},
                                                    {"range", 10.0},
                                                    {"max_radius_px", 8.0},
                                                    {"samples", int64_t(8)}});
    PlanOptions options = only({depth_of_field::kRuleFocusBlocks}, Precision::fp32);
    options.outputs = {Role::color, Role::hint};
    const Elided elided = expect_same_bits(chain, describe(planes), planes, options);
    EXPECT_TRUE(elided.outputs.count(Role::hint));
    EXPECT_GT(elided.blocks("still_blocks"), 10u);
}

// Values that no image should have, but a frame may: no value of the unneeded blocks must reach the
// others, not even with weight 0.
TEST(FocusTiles, LargeAndNonFiniteColors) {
    for (size_t k = 0; k < 3; ++k) {
        const Precision precision = kPrecisions[k % 2];
        FramePlanes planes = focused(90, 70, 5);
        ImageF& color = planes[Role::color];
        for (size_t i = 0; i < color.data.size(); i += 7) color.data[i] = i % 3 ? 3e38f : INFINITY;
        for (size_t i = 1; i < color.data.size(); i += 97) color.data[i] = NAN;
        for (int x = 30; x < 60; ++x) planes[Role::inverse_depth].at(x, 40) = 0.03f;
        FrameDescription frame = describe(focused(90, 70, 5));
        frame.bounds = FrameBounds();
        const Elided elided =
            expect_same_bits(focus_chain(8, 2.0 * double(kFactors[k]), kFactors[k], kLeaks[k]),
                             frame, planes, only({depth_of_field::kRuleFocusBlocks}, precision));
        EXPECT_GT(elided.blocks("sharp_blocks"), 10u);
    }
}

}  // namespace
}  // namespace postchain::test::focus_blocks_test
