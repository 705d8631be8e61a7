// Deep pixels of generated scenes: closed forms of their two samples.
#include "tools/scenes/deep_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace postchain::scenes::deep_samples_test {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::FloatNear;
using testing::Ge;
using testing::Pointwise;
using Rgba = std::vector<float>;

ScenePlanes plane_of(const Rgba& color, float depth) {
    ScenePlanes planes{ImageF(1, 1, 4), ImageF(1, 1, 1), ImageF(1, 1, 4)};
    planes.color.data = color;
    planes.depth.data = {depth};
    return planes;
}

// The samples of a pixel, front to back.
std::vector<Rgba> samples_of(const Rgba& sharp, const Rgba& behind) {
    const io::DeepSamples deep = deep_samples(plane_of(sharp, 1), plane_of(behind, 2));
    std::vector<Rgba> samples(deep.counts.at(0));
    for (size_t i = 0; i < samples.size(); ++i)
        for (size_t c = 0; c < 4; ++c) samples[i].push_back(deep.channels[c].values[i]);
    return samples;
}

void expect_near(const Rgba& a, const Rgba& b) {
    EXPECT_THAT(a, Pointwise(FloatNear(1e-6F), b));
}

TEST(DeepSamples, GlassIsOverTheWholeLayerBehind) {
    const auto opaque = samples_of({.7F, .4F, .3F, 1}, {.2F, .6F, .1F, 1});
    expect_near(opaque.at(0), {.7F, .4F, .3F, 1});
    expect_near(opaque.at(1), {.2F, .6F, .1F, 1});
    // Half of (.4, .2, .1), and half of a layer of alpha .5.
    const auto glass = samples_of({.3F, .15F, .1F, .75F}, {.2F, .1F, .1F, .5F});
    expect_near(glass.at(0), {.2F, .1F, .05F, .5F});
    expect_near(glass.at(1), {.2F, .1F, .1F, .5F});
}

// The wall covers 3/4 of the pixel, and so does what it hides: behind the wall's part there is
// light of 2, which no even cover of alpha 3/4 lets through.
TEST(DeepSamples, AnEdgeThatHidesALampHasNoNegativeLight) {
    const Rgba edge = {.3F, .15F, .1F, .75F};
    const auto samples = samples_of(edge, {1.5F, .15F, .1F, .75F});
    // k = .3 / (1.5 / 4 + .3 * 3 / 4) = 1 / 2
    expect_near(samples.at(1), {.75F, .075F, .05F, .375F});
    // 1 - alpha = (1/4) / (1 - .375); alpha is the next half, with steps of 2^-11.
    const float alpha = samples.at(0)[3];
    EXPECT_EQ(alpha, 1229 / 2048.0F);
    EXPECT_THAT(alpha, FloatNear(.6F, 1.0F / 2048));
    EXPECT_THAT(samples[0], Each(Ge(0)));
    EXPECT_THAT(samples[0][0], FloatNear(0, .75F / 2048));
    for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(samples[0][c] + (1 - alpha) * samples[1][c], edge[c], 1e-6) << c;
}

TEST(DeepSamples, NoPixelHasNegativeLight) {
    std::minstd_rand random(5);
    const auto unit = [&] { return float(random() % 1000) / 1000; };
    for (int i = 0; i < 3000; ++i) {
        const Rgba sharp = {unit(), unit(), 30 * unit(), .999F * unit()};
        const auto samples = samples_of(sharp, {unit(), 30 * unit(), unit(), unit()});
        ASSERT_THAT(samples[0], Each(Ge(0))) << i;
        for (size_t c = 0; c < 4; ++c)
            ASSERT_NEAR(samples[0][c] + (1 - samples[0][3]) * samples[1][c], sharp[c],
                        1.5e-3 * double(sharp[c]))
                << i << " " << c;
    }
}

TEST(DeepSamples, BlackBeforeLightIsNotLight) {
    const auto samples = samples_of({0, 0, 0, .5F}, {1, 1, 1, .5F});
    expect_near(samples.at(0), {0, 0, 0, .5F});
    expect_near(samples.at(1), {0, 0, 0, 0});
}

TEST(DeepSamples, APixelThatHidesNothingHasOneSample) {
    const io::DeepSamples same =
        deep_samples(plane_of({.1F, .2F, .3F, .5F}, 2), plane_of({.1F, .2F, .3F, .5F}, 2));
    EXPECT_THAT(same.counts, ElementsAre(1u));
    const auto hole = samples_of({.1F, .2F, .3F, .5F}, {0, 0, 0, 0});
    expect_near(hole.at(0), {.1F, .2F, .3F, .5F});
    expect_near(hole.at(1), {0, 0, 0, 0});
}

}  // namespace
}  // namespace postchain::scenes::deep_samples_test
