// The error in three parts, and convergence of a chain.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "tests/measure/experiment/support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/measure/experiment/converge.h"

namespace postchain::experiment {

using namespace report;
namespace {

ImageF plain(float v) {
    return ImageF(16, 16, 3, v);
}

// The split of constant images: the GPU's result, the double reference, the converged image and the
// ground truth.
ErrorSplit split_of(float gpu, double reference, const Converged& converged,
                    std::optional<float> truth) {
    const auto made = truth ? metrics::rgb_image_of(plain(*truth))
                            : Result<metrics::RgbImage>(metrics::RgbImage());
    const auto range = truth ? metrics::exposure_range(*made, metrics::ToneMapper::aces)
                             : metrics::ExposureRange();
    return test::must(split_error(12, plain(gpu), ImageD(16, 16, 3, reference), converged,
                                  truth ? &*made : nullptr, range, {}));
}

Converged converged_to(float v, bool sampled = true) {
    Converged converged;
    converged.rgb = plain(v);
    converged.seeds = 4;
    converged.sampled = sampled;
    return converged;
}

// G = 1.5, R = 1.25, C = 1, T = 0.5 everywhere. Parts 0.25, 0.25, 0.5, squares 1/16, 1/16, 1/4;
// total 1; cross term 2 (1/16 + 1/8 + 1/8) = 5/8. All exact in float.
TEST(ErrorSplit, ConstantPicturesByHand) {
    const ErrorSplit split = split_of(1.5f, 1.25, converged_to(1), 0.5f);
    EXPECT_EQ(split.frames, std::vector<int>{12});
    EXPECT_DOUBLE_EQ(*split.mse.precision, 0.0625);
    EXPECT_DOUBLE_EQ(*split.mse.sampling, 0.0625);
    EXPECT_DOUBLE_EQ(*split.mse.model, 0.25);
    EXPECT_DOUBLE_EQ(*split.mse.total, 1);
    EXPECT_DOUBLE_EQ(*split.cross, 0.625);
    // relMSE of the model: 0.5^2 / (0.5 + 0.01)^2; SMAPE 2 * 0.5 / (1.5 + 0.02).
    EXPECT_NEAR(*split.others.at("relmse").model, 0.25 / (0.51 * 0.51), 1e-6);
    EXPECT_NEAR(*split.others.at("smape").model, 1 / 1.52, 1e-6);
    EXPECT_NEAR(*split.others.at("smape").precision, 0.5 / 2.77, 1e-6);
    EXPECT_TRUE(split.others.at("hdr_flip").total);
}

// 1e-9 beside 1 is lost in float.
TEST(ErrorSplit, PrecisionIsMeasuredInDouble) {
    EXPECT_NEAR(*split_of(1, 1 + 1e-9, converged_to(1), {}).mse.precision, 1e-18, 1e-22);
}

TEST(ErrorSplit, WithoutTruthThereIsNoModelAndNoTotal) {
    const ErrorSplit split = split_of(1.5f, 1.5, converged_to(1), {});
    EXPECT_FALSE(split.mse.model || split.mse.total || split.cross);
    EXPECT_DOUBLE_EQ(*split.mse.sampling, 0.25);
}

// G = 1.5, R = 1.25, T = 0.5 and no converging rows: precision 1/16, sampling 0, model (1.25 -
// 0.5)^2 = 9/16, total 1, cross term 6/16. The converged image is not used.
TEST(ErrorSplit, WhatDoesNotSampleHasNoSamplingError) {
    const ErrorSplit split = split_of(1.5f, 1.25, converged_to(7, false), 0.5f);
    EXPECT_DOUBLE_EQ(*split.mse.precision, 1 / 16.0);
    EXPECT_EQ(*split.mse.sampling, 0);
    EXPECT_DOUBLE_EQ(*split.mse.model, 9 / 16.0);
    EXPECT_DOUBLE_EQ(*split.mse.total, 1);
    EXPECT_DOUBLE_EQ(*split.cross, 6 / 16.0);
    for (const auto& [name, parts] : split.others) EXPECT_EQ(*parts.sampling, 0) << name;
    EXPECT_THAT(split.notes, ::testing::Contains(::testing::HasSubstr("no pass of this chain")));
}

TEST(ErrorSplit, SizesThatDifferAreRefused) {
    struct Sizes {
        std::array<int, 2> gpu, reference, truth;
    };
    constexpr std::array<int, 2> same = {16, 16}, narrow = {8, 16}, low = {16, 8};
    for (const auto& [gpu, reference, truth] : {Sizes{narrow, same, same},
                                                {low, same, same},
                                                {same, narrow, same},
                                                {same, low, same},
                                                {same, same, narrow},
                                                {same, same, low},
                                                {same, same, same}}) {
        const metrics::RgbImage made = {.rgb = ImageF(truth[0], truth[1], 3)};
        const auto split =
            split_error(1, ImageF(gpu[0], gpu[1], 3), ImageD(reference[0], reference[1], 3),
                        converged_to(1), &made, {}, {});
        const bool all = gpu == same && reference == same && truth == same;
        EXPECT_THAT(split.status().message(), ::testing::HasSubstr(all ? "" : "of an error split"));
        EXPECT_EQ(split.ok(), all);
    }
}

TEST(ErrorSplit, MeanOverFrames) {
    ErrorSplit a, b;
    a.frames = {1};
    a.mse = {0.1, 0.2, 0.3, 1.0};
    a.cross = 0.4;
    a.converged_noise = 0.01;
    a.others["relmse"].total = 2;
    b.frames = {2};
    b.converged_noise = 0.03;
    b.mse = {0.3, 0.4, 0.5, 1.6};
    b.cross = 0.4;
    b.others["relmse"].total = 4;
    const ErrorSplit mean = mean_split({a, b});
    EXPECT_EQ(mean.frames, (std::vector<int>{1, 2}));
    EXPECT_DOUBLE_EQ(*mean.mse.precision, 0.2);
    EXPECT_DOUBLE_EQ(*mean.mse.sampling, 0.3);
    EXPECT_DOUBLE_EQ(*mean.mse.model, 0.4);
    EXPECT_DOUBLE_EQ(*mean.mse.total, 1.3);
    EXPECT_DOUBLE_EQ(mean.converged_noise, 0.02);
    EXPECT_DOUBLE_EQ(*mean.cross, 0.4);
    EXPECT_DOUBLE_EQ(*mean.others.at("relmse").total, 3);
    // A part that is missing in one frame has no mean.
    b.mse.model.reset();
    b.others.clear();
    EXPECT_FALSE(mean_split({a, b}).mse.model || mean_split({a, b}).others.at("relmse").total);
}

TEST(ConvergedChain, SetsAndAveragesWhatTheTablesSay) {
    const Chain chain = test::parse(
        "postchain: 1\n"
        "passes: [motion_blur: {mode: guertin, samples: 9, seed: 3}, "
        "depth_of_field: {method: gilham, downsample: 4}, fxaa]\n");
    std::vector<std::string> changes;
    const Chain many = converged_chain(chain, &changes);
    EXPECT_THAT(many.text(), ::testing::HasSubstr("samples=401"));
    EXPECT_THAT(many.text(), ::testing::HasSubstr("downsample=1"));
    EXPECT_THAT(many.text(), ::testing::HasSubstr("seed=3"));
    EXPECT_THAT(chain.text(), ::testing::HasSubstr("samples=9"));  // unchanged
    EXPECT_THAT(changes,
                ::testing::UnorderedElementsAre("passes[0].motion_blur.samples 9 -> 401",
                                                "passes[0].motion_blur.seed averaged",
                                                "passes[1].depth_of_field.downsample 4 -> 1",
                                                "passes[2].fxaa does not sample"));
    EXPECT_TRUE(samples(chain));
    EXPECT_FALSE(samples(test::parse("postchain: 1\npasses: [fxaa]\n")));
    EXPECT_THAT(with_seed_offset(chain, 2).text(), ::testing::HasSubstr("seed=5"));
    EXPECT_EQ(with_seed_offset(chain, 0).text(), chain.text());
    // Seeds go round at the end of their range.
    const Chain last = test::parse("postchain: 1\npasses: [motion_blur: {seed: 2147483647}]\n");
    EXPECT_THAT(with_seed_offset(last, 1).text(), ::testing::HasSubstr(" seed=0 "));
    EXPECT_FALSE(has_seeds(test::parse("postchain: 1\npasses: [fxaa]\n")));
}

// A seed that nothing reads is none: flicker has no value, rather than 0.
TEST(ConvergedChain, ASeedWithoutRandomNumbersIsNone) {
    for (const char* quiet : {"depth_of_field: {method: gilham}", "motion_blur: {noise: none}",
                              "motion_blur: {mode: guertin, jitter: 0, tile_jitter: false}",
                              "motion_blur: {mode: inverse_warp, time_jitter: 0}"}) {
        const Chain chain = test::parse(concat("postchain: 1\npasses: [", quiet, "]\n"));
        EXPECT_FALSE(has_seeds(chain)) << quiet;
        EXPECT_THAT(seeds_of(chain), ::testing::IsEmpty()) << quiet;
    }
    const Chain both = test::parse(
        "postchain: 1\npasses: [motion_blur: {mode: guertin}, depth_of_field: {method: gilham}]\n");
    EXPECT_TRUE(has_seeds(both));
    EXPECT_EQ(seeds_of(both), std::vector<std::string>{"passes[0].motion_blur.seed 0"});
}

TEST(ConvergedChain, TableRowsAreInTheirDomain) {
    int set = 0, averaged = 0;
    for (const auto& type : builtin_passes().types()) {
        for (const Parameter& row : type.parameters->rows()) {
            if (row.convergence == Convergence::set) {
                ++set;
                EXPECT_TRUE(row.check(row.type == ParameterType::integer
                                          ? ParameterValue(int64_t(row.converged))
                                          : ParameterValue(row.converged))
                                .ok())
                    << row.key;
            }
            averaged += row.convergence == Convergence::averaged;
        }
    }
    EXPECT_GT(set, 0);
    EXPECT_GT(averaged, 0);
}

TEST(Converge, WithoutRandomNumbersOneSeedIsEnough) {
    const auto frame = test::layered_frame(48, 32, {9, 2}, {-5, 0});
    const auto converged = [&](const Chain& chain) {
        return test::must(
            converge(chain, frame.description, frame.planes, {}, test::executor(), 4));
    };
    const Converged quiet = converged(test::parse(test::kChainText, {"motion_blur.noise=none"}));
    EXPECT_EQ(quiet.seeds, 1);
    EXPECT_EQ(quiet.noise, 0);
    // Nor if no pixel is random.
    const auto still = test::layered_frame(48, 32, {0, 0}, {0, 0});
    const Chain chain = test::parse(test::kChainText);
    EXPECT_EQ(
        test::must(converge(chain, still.description, still.planes, {}, test::executor(), 4)).seeds,
        1);
    const Converged none = converged(test::parse("postchain: 1\npasses: [fxaa]\n"));
    EXPECT_FALSE(none.sampled);
    EXPECT_EQ(none.seeds, 1);
    EXPECT_EQ(none.changes, std::vector<std::string>{"passes[0].fxaa does not sample"});
}

// Two seeds by hand: mean and standard deviation of the two images.
TEST(Converge, MeanAndNoiseOfTwoSeeds) {
    const auto frame = test::layered_frame(48, 32, {9, 2}, {-5, 0});
    const Chain chain = test::parse(test::kChainText);
    const Chain many = converged_chain(chain, nullptr);
    const auto one = test::filter(many, frame.description, frame.planes).at(Role::color);
    const auto two =
        test::filter(with_seed_offset(many, 1), frame.description, frame.planes).at(Role::color);
    auto converged = converge(chain, frame.description, frame.planes, {}, test::executor(), 2);
    ASSERT_TRUE(converged.ok());
    double noise = 0;
    for (size_t i = 0; i < one.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c) {
            const double a = double(one.data[4 * i + c]), b = double(two.data[4 * i + c]);
            ASSERT_NEAR(converged->rgb.data[3 * i + c], (a + b) / 2, 1e-6);
            // The sample variance of two values is (a - b)^2 / 2; half of that for their mean.
            noise += (a - b) * (a - b) / 4;
        }
    EXPECT_EQ(converged->seeds, 2);
    EXPECT_GT(noise, 0);
    EXPECT_NEAR(converged->noise, noise / (48 * 32 * 3), 1e-6 * converged->noise);
}

}  // namespace
}  // namespace postchain::experiment
