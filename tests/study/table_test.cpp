// The table against figures worked out elsewhere: by hand, and with the t distribution by the
// finite sums of Abramowitz and Stegun, 26.7.3 and 26.7.4.
#include <gtest/gtest.h>

#include "tools/measure/study/table.h"

namespace postchain::study {
namespace {

using report::Better;

const std::vector<std::string> kNames = {"a", "b"};
const std::vector<std::pair<size_t, size_t>> kPairs = {{0, 1}};

SceneFigures scene(const std::string& name, const std::string& family, const Values& a,
                   const Values& b, const std::string& metric = "mse") {
    SceneFigures figures{name, family, {}, {}};
    figures.variants[0][metric] = a;
    figures.variants[1][metric] = b;
    figures.pairs[0].a[metric] = a;
    figures.pairs[0].b[metric] = b;
    return figures;
}

MetricTable table(const std::vector<SceneFigures>& scenes, Better better = Better::lower) {
    const auto tables = tables_of({{"mse", "help", better}}, kNames, kPairs, scenes);
    EXPECT_EQ(tables.size(), 1u);
    return tables.empty() ? MetricTable() : tables.front();
}

// Gains of the scenes 0.2, 0.04, -0.02, 0.1; of the families 0.12, -0.02, 0.1.
TEST(Table, FamiliesCountOnce) {
    const MetricTable found =
        table({scene("one", "x", {0.5, 0.7}, {0.3, 0.5}), scene("two", "x", {0.24}, {0.2}),
               scene("three", "y", {0.1}, {0.12}), scene("four", "z", {0.3}, {0.2})});
    ASSERT_EQ(found.families.size(), 3u);
    EXPECT_EQ(found.families[0].scenes, 2u);
    EXPECT_NEAR(*found.scenes[0].gains[0], 0.2, 1e-12);
    EXPECT_NEAR(*found.families[0].gains[0], 0.12, 1e-12);
    EXPECT_NEAR(*found.families[1].gains[0], -0.02, 1e-12);
    const PairResult& result = found.pairs[0];
    EXPECT_NEAR(*result.mean, 0.06666666666666667, 1e-12);
    ASSERT_TRUE(result.interval);
    EXPECT_NEAR(result.interval->low, -0.12142920511168183, 1e-9);
    EXPECT_NEAR(result.interval->high, 0.2547625384450152, 1e-9);
    EXPECT_EQ(result.families, 3);
    EXPECT_EQ(result.nearer, 2);
    EXPECT_EQ(result.farther, 1);
    EXPECT_EQ(result.scenes, 4);
    EXPECT_EQ(result.scenes_nearer, 3);
    EXPECT_DOUBLE_EQ(result.sign_probability, 1);
    EXPECT_EQ(result.decision, Decision::not_decided);
    // (0.6 + 0.24) / 2, 0.1, 0.3 over three families.
    EXPECT_NEAR(*found.means[0], (0.42 + 0.1 + 0.3) / 3, 1e-12);
    EXPECT_EQ(found.best, 1u);
}

// Two families: mean -+ 12.7062 s / sqrt(2), and s / sqrt(2) is half their distance.
TEST(Table, TwoFamiliesHaveTheWidestInterval) {
    const PairResult result =
        table({scene("one", "x", {0.5}, {0.4}), scene("two", "y", {0.5}, {0.398})}).pairs[0];
    EXPECT_NEAR(*result.mean, 0.101, 1e-12);
    EXPECT_NEAR(result.interval->low, 0.101 - 12.706204736 * 0.001, 1e-9);
    EXPECT_NEAR(result.interval->high, 0.101 + 12.706204736 * 0.001, 1e-9);
    EXPECT_EQ(result.decision, Decision::b);
    EXPECT_EQ(result.words, "b is closer than a by 0.101 (0.08829 to 0.1137), in 2 of 2 families");
}

TEST(Table, OneFamilyDecidesNothing) {
    const PairResult result =
        table({scene("one", "x", {0.5}, {0.4}), scene("two", "x", {0.5}, {0.4})}).pairs[0];
    EXPECT_FALSE(result.interval);
    EXPECT_EQ(result.decision, Decision::too_few);
}

TEST(Table, TheWinnerIsNamedWhereItIsTheFirst) {
    const PairResult result =
        table({scene("one", "x", {0.4}, {0.5}), scene("two", "y", {0.4}, {0.502})}).pairs[0];
    EXPECT_EQ(result.decision, Decision::a);
    EXPECT_EQ(result.words, "a is closer than b by 0.101 (0.08829 to 0.1137), in 2 of 2 families");
}

TEST(Table, ALargerPsnrAndARatioNearerToOneAreNearer) {
    const MetricTable psnr = table({scene("one", "x", {30}, {32})}, Better::higher);
    EXPECT_DOUBLE_EQ(*psnr.scenes[0].gains[0], 2);
    EXPECT_EQ(psnr.best, 1u);
    // Frame by frame: |1.2 - 1| - |0.9 - 1| = 0.1 and |0.9 - 1| - |1.3 - 1| = -0.2.
    const MetricTable ratio = table({scene("one", "x", {1.2, 0.9}, {0.9, 1.3})}, Better::one);
    EXPECT_NEAR(*ratio.scenes[0].gains[0], -0.05, 1e-12);
    EXPECT_DOUBLE_EQ(gain_of(Better::one, 0.5, 1.25), 0.25);
}

TEST(Table, FramesWithoutAValueInOneOfBothDoNotCount) {
    const MetricTable found =
        table({scene("one", "x", {std::nullopt, 0.5, 0.9}, {0.1, 0.3, std::nullopt})});
    EXPECT_NEAR(*found.scenes[0].gains[0], 0.2, 1e-12);
}

// A family that lacks a variant would make the means of the others incomparable.
TEST(Table, MeansAreOverFamiliesThatHaveAll) {
    const MetricTable found =
        table({scene("one", "x", {0.5}, {0.4}), scene("two", "y", {9.0}, {std::nullopt})});
    EXPECT_DOUBLE_EQ(*found.means[0], 0.5);
    EXPECT_DOUBLE_EQ(*found.means[1], 0.4);
}

TEST(Table, MetricsWithoutAValueAreNotThere) {
    EXPECT_TRUE(
        tables_of({{"tde", "", Better::lower}}, kNames, kPairs, {scene("one", "x", {0.5}, {0.4})})
            .empty());
}

TEST(Table, EqualPicturesHaveNoWinner) {
    const PairResult result =
        table({scene("one", "x", {0.5}, {0.5}), scene("two", "y", {0.4}, {0.4})}).pairs[0];
    EXPECT_EQ(result.decision, Decision::not_decided);
    EXPECT_EQ(result.words, "no difference");
}

TEST(Table, SignsAreThrowsOfACoin) {
    EXPECT_NEAR(sign_probability(9, 0), 0.00390625, 1e-12);  // 2 / 2^9
    EXPECT_NEAR(sign_probability(8, 1), 0.0390625, 1e-12);   // 2 (1 + 9) / 2^9
    EXPECT_DOUBLE_EQ(sign_probability(2, 2), 1);
    EXPECT_DOUBLE_EQ(sign_probability(0, 0), 1);
}

}  // namespace
}  // namespace postchain::study
