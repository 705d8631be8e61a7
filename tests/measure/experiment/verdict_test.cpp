// Verdicts on differences, from fabricated values.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/statistics.h"

namespace postchain::experiment::verdict_test {

using namespace report;
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Report fabricate(const std::string& metric, Better better, const std::vector<double>& a,
                 const std::vector<double>& b) {
    Report report;
    report.reference = "truth";
    report.metrics = {{metric, "", better}};
    report.variants.resize(2);
    report.variants[0].name = "first";
    report.variants[1].name = "second";
    for (size_t i = 0; i < a.size(); ++i) {
        report.frames.push_back(int(i) + 1);
        set_value(report.variants[0].metrics, metric, i, a.size(), a[i]);
        set_value(report.variants[1].metrics, metric, i, a.size(), b[i]);
    }
    for (Variant& variant : report.variants) find_means(variant.metrics);
    return report;
}

const std::vector<double> kBase = {0.10, 0.12, 0.11, 0.13, 0.10, 0.12, 0.11, 0.13};

std::vector<double> shifted(const std::vector<double>& values, std::vector<double> by) {
    for (size_t i = 0; i < by.size(); ++i) by[i] += values[i];
    return by;
}

const std::vector<double> kConstantGain = {-.010, -.012, -.011, -.009, -.010, -.011, -.012, -.009};
const std::vector<double> kScatter = {-.010, .012, -.011, .009, .010, -.011, .012, -.009};

TEST(Verdict, SevenFramesAreTooFewWhateverTheyShow) {
    std::vector<double> a(kBase.begin(), kBase.begin() + 7);
    std::vector<double> gain(kConstantGain.begin(), kConstantGain.begin() + 7);
    const auto report = fabricate("hdr_flip", Better::lower, a, shifted(a, gain));
    const Comparison comparison = compare_variants(report, {});
    EXPECT_EQ(comparison.metrics[0].finding, Finding::too_few_frames);
    EXPECT_EQ(comparison.metrics[0].n, 7);
    EXPECT_LT(comparison.metrics[0].t_interval->high, 0);  // shown but not decisive
    EXPECT_THAT(comparison.metrics[0].words, HasSubstr("too few frames to decide (n = 7)"));
    EXPECT_THAT(comparison.verdict, HasSubstr("Too few frames to decide (n = 7"));
    EXPECT_THAT(comparison.verdict, Not(HasSubstr("is closer to the ground truth by")));
}

TEST(Verdict, EightFramesOfConstantGainDecide) {
    const auto report = fabricate("hdr_flip", Better::lower, kBase, shifted(kBase, kConstantGain));
    const Comparison comparison = compare_variants(report, {});
    EXPECT_EQ(comparison.metrics[0].finding, Finding::b_better);
    EXPECT_NEAR(*comparison.metrics[0].mean, -0.0105, 1e-12);
    EXPECT_THAT(comparison.verdict, HasSubstr("second is closer to the ground truth by hdr_flip"));
    EXPECT_THAT(comparison.metrics[0].words, HasSubstr("second is lower by 0.0105"));
    // The values are printed too: 0.115 and 0.1045.
    EXPECT_THAT(comparison.verdict, HasSubstr("HDR-FLIP: first 0.115, second 0.1045"));
    // And reversed.
    const auto turned = fabricate("hdr_flip", Better::lower, shifted(kBase, kConstantGain), kBase);
    EXPECT_EQ(compare_variants(turned, {}).metrics[0].finding, Finding::a_better);
}

TEST(Verdict, ScatterAroundZeroIsNoMeasurableDifference) {
    const auto report = fabricate("hdr_flip", Better::lower, kBase, shifted(kBase, kScatter));
    const Comparison comparison = compare_variants(report, {});
    EXPECT_EQ(comparison.metrics[0].finding, Finding::no_measurable_difference);
    EXPECT_THAT(comparison.verdict, HasSubstr("No measurable difference in any metric (n = 8)"));
}

TEST(Verdict, EqualPicturesAreCalledEqual) {
    const Comparison comparison =
        compare_variants(fabricate("hdr_flip", Better::lower, kBase, kBase), {});
    EXPECT_EQ(comparison.metrics[0].finding, Finding::no_measurable_difference);
    EXPECT_EQ(comparison.metrics[0].words, "equal in all 8 frames");
    EXPECT_THAT(comparison.verdict, HasSubstr("every metric is equal in all 8 frames"));
    EXPECT_THAT(compare_variants(fabricate("hdr_flip", Better::lower, {0.1}, {0.1}), {}).verdict,
                HasSubstr("every metric is equal in the one frame."));
}

TEST(Verdict, MoreIsBetterForPsnr) {
    const auto report = fabricate("psnr", Better::higher, kBase, shifted(kBase, kConstantGain));
    EXPECT_EQ(compare_variants(report, {}).metrics[0].finding, Finding::a_better);
}

TEST(Verdict, RatiosAreComparedByTheirDistanceFromOne) {
    // 0.7 against 1.2: distances 0.3 and 0.2, so B is closer by 0.1 although it is larger.
    const auto report = fabricate("edges_in_blurred", Better::one, std::vector<double>(8, 0.7),
                                  std::vector<double>(8, 1.2));
    const Comparison comparison = compare_variants(report, {});
    EXPECT_NEAR(*comparison.metrics[0].mean, -0.1, 1e-12);
    EXPECT_EQ(comparison.metrics[0].finding, Finding::b_better);
    EXPECT_THAT(comparison.claims, HasSubstr("Edges in blurred regions: first 0.7, second 1.2"));
}

TEST(Verdict, FramesThatOneVariantLacksAreLeftOut) {
    auto report = fabricate("hdr_flip", Better::lower, kBase, shifted(kBase, kConstantGain));
    report.variants[1].metrics["hdr_flip"].frames[3].reset();
    report.variants[1].failure = "frame 4: out of memory";
    const Comparison comparison = compare_variants(report, {});
    EXPECT_EQ(comparison.metrics[0].n, 7);
    EXPECT_FALSE(comparison.metrics[0].differences[3]);
    EXPECT_THAT(comparison.verdict, HasSubstr("second failed: frame 4: out of memory"));
}

TEST(Verdict, TilesAreTheSecondFigure) {
    const std::vector<double> a = {0.2, 0.2}, b = {0.1, 0.1};
    std::map<std::string, TileBootstrap> tiles;
    TileBootstrap bootstrap(1, 100);
    TileSums sums;
    sums.sums = {-1, -1};
    sums.pixels = {10, 10};
    bootstrap.add(1, sums);
    tiles.emplace("hdr_flip", bootstrap);
    const Comparison comparison =
        compare_variants(fabricate("hdr_flip", Better::lower, a, b), tiles);
    EXPECT_NEAR(comparison.metrics[0].bootstrap->low, -0.1, 1e-12);
    EXPECT_EQ(comparison.metrics[0].tiles, 2);
    EXPECT_THAT(comparison.verdict, HasSubstr("Within these frames second is closer"));
    EXPECT_THAT(comparison.verdict, HasSubstr("this need not hold for other frames"));
}

TEST(Verdict, WithoutATruthNobodyWins) {
    auto report = fabricate("hdr_flip", Better::lower, {0, 0}, {0.1, 0.2});
    report.reference = "a";
    report.variants[0].metrics.clear();
    const Comparison comparison = compare_variants(report, {});
    EXPECT_TRUE(comparison.metrics.empty());
    EXPECT_THAT(comparison.verdict, HasSubstr("Without a ground truth"));
    EXPECT_THAT(comparison.verdict, HasSubstr("HDR-FLIP is 0.15"));
}

}  // namespace
}  // namespace postchain::experiment::verdict_test
