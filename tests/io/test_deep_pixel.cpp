// Compositing of a deep pixel: closed forms of opacity, surfaces and what is behind them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "chain/base/status.h"
#include "tools/sequence/exr/deep_pixel.h"

namespace postchain::io::test_deep_pixel {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::Ge;
using testing::Le;

struct Sample {
    double front, back, alpha;
};

Sample at(double depth, double alpha) {
    return {depth, depth, alpha};
}

struct Composited {
    std::vector<double> weights;
    int64_t surface = -1;
    double alpha = 0;
};

Composited composite(const std::vector<Sample>& samples, bool behind = false) {
    DeepPixel pixel;
    for (size_t i = 0; i < samples.size(); ++i)
        pixel.samples().push_back({float(samples[i].front), float(samples[i].back),
                                   float(samples[i].alpha), uint32_t(i)});
    pixel.composite(behind);
    Composited result;
    result.surface = pixel.surface();
    result.alpha = pixel.alpha();
    for (size_t i = 0; i < samples.size(); ++i) result.weights.push_back(pixel.weight(i));
    return result;
}

TEST(DeepPixel, FrontSamplesHideThoseBehindInAnyOrder) {
    EXPECT_THAT(composite({at(1, .25), at(2, .5), at(3, 1), at(4, 1)}).weights,
                ElementsAre(1, .75, .375, 0));
    EXPECT_THAT(composite({at(4, 1), at(2, .5), at(3, 1), at(1, .25)}).weights,
                ElementsAre(0, .75, .375, 1));
}

TEST(DeepPixel, TheSurfaceIsWhereHalfTheOpacityIsReached) {
    const std::pair<std::vector<Sample>, int> cases[] = {
        {{at(1, .6), at(3, 1)}, 0},
        {{at(1, .4), at(3, 1)}, 1},
        {{at(1, .5), at(3, 1)}, 0},
        {{at(1, .3)}, 0},                       // hair before nothing
        {{at(1, .1), at(2, .3)}, 1},            // the most of what is there
        {{at(1, .2), at(2, .2), at(3, 1)}, 2},  // two veils
        {{at(1, .4), at(2, .1)}, 0},            // half of what is there
        {{at(2, 0)}, 0},                        // clear, but its depth is known
        {{}, -1}};
    for (const auto& [samples, surface] : cases) EXPECT_EQ(composite(samples).surface, surface);
}

TEST(DeepPixel, BehindASurfaceIsTheNext) {
    // An edge that covers most of the pixel, one that covers less, an opaque surface.
    EXPECT_THAT(composite({at(1, .6), at(3, 1)}, true).weights, ElementsAre(0, 1));
    const Composited veiled = composite({at(1, .4), at(3, 1), at(5, .5), at(6, 1)}, true);
    EXPECT_THAT(veiled.weights, ElementsAre(0, 0, 1, .5));
    EXPECT_EQ(veiled.surface, 2);
    EXPECT_THAT(composite({at(9, 1), at(1, 1)}, true).weights, ElementsAre(1, 0));
}

// Slices of one surface, as of a slope in the pixel, are no layers.
TEST(DeepPixel, SlicesOfOneSurfaceBelongTogether) {
    const std::vector<Sample> slope = {at(3, .25), at(3.1, 1 / 3.), at(3.2, .5), at(3.3, 1)};
    EXPECT_EQ(composite(slope).surface, 1);
    std::vector<Sample> wall = slope;
    wall.push_back(at(3.35, 1));  // behind what is opaque, however close
    EXPECT_THAT(composite(wall, true).weights, ElementsAre(0, 0, 0, 0, 1));
    wall[3].alpha = .5;
    wall.push_back(at(7, 1));
    EXPECT_THAT(composite(wall, true).weights, ElementsAre(0, 0, 0, 0, 0, 1));
    // A gap of more than 5 %.
    EXPECT_THAT(composite({at(3, .6), at(3.16, 1)}, true).weights, ElementsAre(0, 1));
    EXPECT_THAT(composite({at(3, .6), at(3.14, 1), at(5, 1)}, true).weights, ElementsAre(0, 0, 1));
    // A volume is as deep as its back, whether it is the surface or follows it, and whatever ends
    // before it.
    EXPECT_THAT(composite({{3, 5, .6}, at(5.1, .5), at(8, 1)}, true).weights, ElementsAre(0, 0, 1));
    EXPECT_THAT(
        composite({at(3, .6), {3.1, 5, .5}, at(3.2, .1), at(5.1, .5), at(8, 1)}, true).weights,
        ElementsAre(0, 0, 0, 0, 1));
    EXPECT_THAT(composite({at(3, .6), {3.1, 5, .5}, at(5.3, 1)}, true).weights,
                ElementsAre(0, 0, 1));
}

TEST(DeepPixel, WithNothingBehindASurfaceIsShownAgain) {
    const Composited again = composite({at(1, .3), at(3, 1)}, true);
    EXPECT_THAT(again.weights, ElementsAre(0, 1));  // without the veil
    EXPECT_EQ(again.surface, 1);
    // Through an edge the file says that nothing is there.
    const Composited clear = composite({at(1, .6)}, true);
    EXPECT_THAT(clear.weights, ElementsAre(0));
    EXPECT_EQ(clear.surface, -1);
}

TEST(DeepPixel, VolumesThatOverlapMixByDensity) {
    // One volume twice: twice the optical depth, in equal shares.
    const Composited twice = composite({{1, 2, .5}, {1, 2, .5}});
    EXPECT_THAT(twice.alpha, DoubleNear(.75, 1e-12));
    EXPECT_THAT(twice.weights[0], DoubleNear(.75, 1e-12));
    // A surface in the middle of a volume hides its far half.
    const Composited inside = composite({{1, 3, .75}, at(2, 1)});
    EXPECT_THAT(inside.weights[0] * .75, DoubleNear(.5, 1e-12));
    EXPECT_THAT(inside.weights[1], DoubleNear(.5, 1e-12));
    // Light without opacity, spread over a volume: its near half is seen before the surface.
    EXPECT_THAT(composite({{1, 3, 0}, at(2, 1)}).weights[0], DoubleNear(.5, 1e-12));
    // Where one of two ends, the light goes on with the density of the other, also of a later one.
    EXPECT_THAT(composite({{1, 2, .5}, {1, 3, .75}, at(4, 1)}).weights[2], DoubleNear(.125, 1e-12));
    EXPECT_THAT(composite({{1, 3, .75}, {2, 3, .5}, at(4, 1)}).weights[2], DoubleNear(.125, 1e-12));
    // Volumes that touch are one after the other.
    EXPECT_THAT(composite({{1, 2, .5}, {2, 3, .5}}).weights, ElementsAre(1, .5));
}

TEST(DeepPixel, SurfacesAtOneDepthMix) {
    EXPECT_THAT(
        composite({at(1, .5), at(1, .5), at(2, 1)}).weights,
        ElementsAre(DoubleNear(.75, 1e-12), DoubleNear(.75, 1e-12), DoubleNear(.25, 1e-12)));
    EXPECT_THAT(composite({at(1, 1), at(1, 1)}).weights, ElementsAre(.5, .5));
    EXPECT_THAT(composite({at(1, 1), at(1, .5)}).weights, ElementsAre(1, 0));
}

// The split of volumes by hand, into slices so thin that their order does not matter.
TEST(DeepPixel, AgreesWithThinSlices) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int n = 0; n < 20; ++n) {
        std::vector<Sample> samples;
        for (int i = 0; i < 6; ++i) {
            const double front = float(unit(random) * 4),
                         back = i % 3 ? float(front + .2 + unit(random)) : front;
            samples.push_back({front, back, float(unit(random) * .9)});
        }
        constexpr int kSlices = 20000;
        std::vector<double> weights(samples.size());
        double through = 1;
        for (int slice = 0; slice < kSlices; ++slice) {
            const double low = 6. * slice / kSlices, high = 6. * (slice + 1) / kSlices;
            for (size_t i = 0; i < samples.size(); ++i) {
                const Sample& s = samples[i];
                double part = 0, alpha = 0;
                if (s.front == s.back) {
                    if (s.front < low || s.front >= high) continue;
                    part = 1;
                    alpha = s.alpha;
                } else {
                    const double length =
                        std::max(0., std::min(high, s.back) - std::max(low, s.front));
                    alpha = 1 - std::pow(1 - s.alpha, length / (s.back - s.front));
                    part = alpha / s.alpha;
                }
                weights[i] += through * part;
                through *= 1 - alpha;
            }
        }
        const Composited result = composite(samples);
        for (size_t i = 0; i < samples.size(); ++i)
            EXPECT_THAT(result.weights[i], DoubleNear(weights[i], 1e-3)) << n << " " << i;
        EXPECT_THAT(result.alpha, DoubleNear(1 - through, 1e-9));
    }
}

TEST(DeepPixel, ValuesThatMeanNothingDoNoHarm) {
    const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
    for (const double depth : {nan, inf, -inf, 0., -1., 3e38})
        for (const double back : {nan, inf, -inf, 0., 1e-30})
            for (const double alpha : {nan, -1., 0., .5, 2., inf})
                for (const bool behind : {false, true}) {
                    const Composited odd =
                        composite({{depth, back, alpha}, at(1, .5), {depth, back, alpha}}, behind);
                    SCOPED_TRACE(concat(depth, " ", back, " ", alpha));
                    EXPECT_THAT(odd.weights, testing::Each(AllOf(Ge(0), Le(1))));
                    EXPECT_THAT(odd.alpha, AllOf(Ge(0), Le(1 + 1e-12)));
                }
    EXPECT_EQ(composite({at(nan, 1), at(5, 1)}).surface, 1);  // NaN: farther than all
    // Alpha is clamped in 0..1; NaN is 0.
    for (const double alpha : {3., inf})
        EXPECT_THAT(composite({at(1, alpha), at(2, 1)}).weights, ElementsAre(1, 0));
    for (const double alpha : {-.5, nan}) EXPECT_EQ(composite({at(1, alpha), at(2, .5)}).alpha, .5);
}

}  // namespace
}  // namespace postchain::io::test_deep_pixel
