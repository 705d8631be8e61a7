// The table against figures worked out elsewhere: by hand, and with the t distribution by the
// finite sums of Abramowitz and Stegun, 26.7.3 and 26.7.4.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/statistics.h"
#include "tools/measure/study/table.h"

namespace postchain::study {
namespace {

using report::Better;

const std::vector<std::string> kNames = {"a", "b"};
const std::vector<std::pair<size_t, size_t>> kPairs = {{0, 1}};

// The figures of variant 0 and of variant `v`, and of their pair.
void set_pair(SceneFigures& figures, size_t v, const std::string& metric, const Values& a,
              const Values& b) {
    figures.variants[0][metric] = figures.pairs[v - 1].a[metric] = a;
    figures.variants[v][metric] = figures.pairs[v - 1].b[metric] = b;
}

SceneFigures scene(const std::string& name, const std::string& family, const Values& a,
                   const Values& b, const std::string& metric = "mse") {
    SceneFigures figures{name, family, {}, {}};
    set_pair(figures, 1, metric, a, b);
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
TEST(Table, TwoFamiliesHaveTheWidestIntervalAndOneDecidesNothing) {
    const auto result = [](double a, double b, double c, double d, const char* family = "y") {
        return table({scene("one", "x", {a}, {b}), scene("two", family, {c}, {d})}).pairs[0];
    };
    const PairResult second = result(0.5, 0.4, 0.5, 0.398);
    EXPECT_NEAR(*second.mean, 0.101, 1e-12);
    EXPECT_NEAR(second.interval->low, 0.101 - 12.706204736 * 0.001, 1e-9);
    EXPECT_NEAR(second.interval->high, 0.101 + 12.706204736 * 0.001, 1e-9);
    EXPECT_EQ(second.decision, Decision::b);
    EXPECT_EQ(second.words,
              "b is closer than a by 0.101 (0.08829 to 0.1137; p 0.0063), in 2 of 2 families");
    const PairResult first = result(0.4, 0.5, 0.4, 0.502);
    EXPECT_EQ(first.decision, Decision::a);
    EXPECT_EQ(first.words.find("a is closer than b by 0.101 (0.08829 to 0.1137; "), 0u);
    EXPECT_EQ(result(0.5, 0.5, 0.4, 0.4).words, "no difference");
    const PairResult alone = result(0.5, 0.4, 0.5, 0.4, "x");
    EXPECT_FALSE(alone.interval);
    EXPECT_EQ(alone.decision, Decision::too_few);
    EXPECT_EQ(alone.words, "b is closer than a by 0.1 in the only family; nothing is decided");
    // Decided, and small.
    const auto small =
        tables_of({{"mse", "help", Better::lower}}, kNames, kPairs,
                  {scene("one", "x", {0.4}, {0.5}), scene("two", "y", {0.4}, {0.502})},
                  {{"mse", 0.15}})[0]
            .pairs[0];
    EXPECT_EQ(small.decision, Decision::a);
    EXPECT_EQ(small.words,
              "a is closer than b by 0.101 (0.08829 to 0.1137; p 0.0063), in 2 of 2 families, "
              "which is less than 0.15");
}

TEST(Table, ALargerPsnrAndARatioNearerToOneAreNearer) {
    const MetricTable psnr = table({scene("one", "x", {30}, {32})}, Better::higher);
    EXPECT_DOUBLE_EQ(*psnr.scenes[0].gains[0], 2);
    EXPECT_EQ(psnr.best, 1u);
    EXPECT_EQ(table({scene("one", "x", {32}, {30})}, Better::higher).best, 0u);
    EXPECT_EQ(table({scene("one", "x", {32}, {32})}, Better::higher).best, 0u);
    // Frame by frame: |1.2 - 1| - |0.9 - 1| = 0.1 and |0.9 - 1| - |1.3 - 1| = -0.2.
    const MetricTable ratio = table({scene("one", "x", {1.2, 0.9}, {0.9, 1.3})}, Better::one);
    EXPECT_NEAR(*ratio.scenes[0].gains[0], -0.05, 1e-12);
}

TEST(Table, FramesWithoutAValueInOneOfBothDoNotCount) {
    const MetricTable found =
        table({scene("one", "x", {std::nullopt, 0.5, 0.9}, {0.1, 0.3, std::nullopt})});
    EXPECT_NEAR(*found.scenes[0].gains[0], 0.2, 1e-12);
    EXPECT_EQ(table({scene("one", "x", {0.5}, {std::nullopt})}).pairs[0].words,
              "no scene has a value");
}

// A family that lacks a variant would make the means of the others incomparable.
TEST(Table, MeansAreOverFamiliesThatHaveAll) {
    const MetricTable found =
        table({scene("one", "x", {0.5}, {0.4}), scene("two", "y", {9.0}, {std::nullopt})});
    EXPECT_DOUBLE_EQ(*found.means[0], 0.5);
    EXPECT_DOUBLE_EQ(*found.means[1], 0.4);
    // A metric without a value has no table.
    EXPECT_TRUE(
        tables_of({{"tde", "", Better::lower}}, kNames, kPairs, {scene("one", "x", {0.5}, {0.4})})
            .empty());
}

// Gains of five families; probabilities by integrating Student's density with 30 digits
// (mpmath 1.3).
const std::vector<double> kGains = {0.012, 0.003, -0.001, 0.006, 0.009};

std::vector<SceneFigures> scenes_with(const std::vector<double>& gains,
                                      const std::string& metric = "mse") {
    std::vector<SceneFigures> scenes;
    for (size_t i = 0; i < gains.size(); ++i) {
        const std::string name(1, char('a' + i));
        scenes.push_back(scene(name, name, {0.5}, {0.5 - gains[i]}, metric));
    }
    return scenes;
}

PairResult student(const std::map<std::string, double>& margins) {
    return tables_of({{"mse", "help", Better::lower}}, kNames, kPairs, scenes_with(kGains),
                     margins)[0]
        .pairs[0];
}

TEST(Table, ProbabilitiesAreThoseOfStudent) {
    const PairResult result = student({{"mse", 0.012}});
    EXPECT_NEAR(result.difference->corrected, 0.0627529275441074, 1e-9);
    EXPECT_NEAR(result.equivalence->alone, 0.0260947112961088, 1e-9);
    EXPECT_EQ(result.decision, Decision::equal);
    EXPECT_EQ(result.words,
              "no difference beyond 0.012 (p 0.0261): b is closer than a by 0.0058 (-0.0004946 to "
              "0.01209; p 0.0628), in 4 of 5 families");
}

// The same gains: what is asked decides between "not shown" and "shown to be small".
TEST(Table, NotDecidedAndEqualAreTold) {
    using Margins = std::map<std::string, double>;
    for (const auto& [margins, decision] : {std::pair{Margins(), Decision::not_decided},
                                            {{{"mse", 0.005}}, Decision::not_decided},
                                            {{{"mse", 0.02}}, Decision::equal}})
        EXPECT_EQ(student(margins).decision, decision) << margins.size();
    std::string margins;
    for (const auto& metric : experiment::metric_columns(report::Kind::bench, true))
        if (const auto margin = default_margin(metric.name))
            margins += concat(metric.name, " ", *margin, " ");
    EXPECT_EQ(margins, "flip 0.005 hdr_flip 0.005 psnr 0.4 ssim 0.002 tde 0.002 ");
    // A default margin: 0.005 of hdr_flip.
    const auto small = tables_of({{"hdr_flip", "help", Better::lower}}, kNames, kPairs,
                                 scenes_with({0.001, -0.001, 0.0005, -0.0004}, "hdr_flip"));
    EXPECT_EQ(small[0].pairs[0].decision, Decision::equal);
    EXPECT_DOUBLE_EQ(*small[0].pairs[0].margin, 0.005);
}

// Alone, 0.0063 decides (TwoFamiliesHaveTheWidestInterval); among eight questions it does not.
TEST(Table, HolmCorrectsForTheQuestions) {
    std::vector<std::string> names = {"a"};
    std::vector<std::pair<size_t, size_t>> pairs;
    std::vector<SceneFigures> scenes = {{"one", "x", {}, {}}, {"two", "y", {}, {}}};
    for (size_t q = 0; q < 8; ++q) {
        names.push_back(std::string("b") + char('0' + q));
        pairs.emplace_back(0, q + 1);
        // The first gain is 0.101, the others are of no clear sign.
        const double last = q == 0 ? 0.398 : 0.6;
        set_pair(scenes[0], q + 1, "mse", {0.5}, {0.4});
        set_pair(scenes[1], q + 1, "mse", {0.5}, {last});
    }
    const auto found =
        tables_of({{"mse", "help", Better::lower}}, names, pairs, scenes, {{"mse", 0.15}})[0].pairs;
    EXPECT_NEAR(found[0].equivalence->corrected, 8 * found[0].equivalence->alone, 1e-12);
    EXPECT_NEAR(found[0].difference->corrected, 8 * found[0].difference->alone, 1e-12);
    EXPECT_EQ(found[0].decision, Decision::not_decided);
    EXPECT_EQ(found[1].difference->corrected, 1);
}

// By hand: 4 x 0.01, 3 x 0.02, 2 x 0.03 falls to 0.06 of the one before, 1 x 0.5.
TEST(Statistics, HolmNeverFallsAndStaysBelowOne) {
    using ::testing::DoubleEq;
    EXPECT_THAT(
        experiment::holm({0.02, 0.5, 0.01, 0.03}),
        ::testing::ElementsAre(DoubleEq(0.06), DoubleEq(0.5), DoubleEq(0.04), DoubleEq(0.06)));
    EXPECT_DOUBLE_EQ(experiment::holm({0.7, 0.8})[1], 1);
}

// Ends of the interval: binomial sums of 2.5 % there.
TEST(Statistics, SharesHaveTheExactInterval) {
    const auto tail = [](int from, int to, int n, double share) {
        double sum = 0;
        for (int k = from; k <= to; ++k)
            sum += std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) +
                            k * std::log(share) + (n - k) * std::log1p(-share));
        return sum;
    };
    for (const auto& [k, n] : {std::pair(14, 17), {1, 9}, {50, 100}}) {
        const auto interval = experiment::share_interval(k, n);
        EXPECT_NEAR(tail(k, n, n, interval.low), 0.025, 1e-9);
        EXPECT_NEAR(tail(0, k, n, interval.high), 0.025, 1e-9);
    }
    EXPECT_EQ(experiment::share_interval(0, 5).low, 0);
    EXPECT_NEAR(experiment::share_interval(0, 5).high, 1 - std::pow(0.025, 0.2), 1e-9);
    EXPECT_EQ(experiment::share_interval(5, 5).high, 1);
}

TEST(Table, SignsAreThrowsOfACoin) {
    using experiment::sign_probability;
    EXPECT_NEAR(sign_probability(9, 0), 0.00390625, 1e-12);  // 2 / 2^9
    EXPECT_NEAR(sign_probability(8, 1), 0.0390625, 1e-12);   // 2 (1 + 9) / 2^9
    EXPECT_DOUBLE_EQ(sign_probability(2, 2), 1);
    EXPECT_DOUBLE_EQ(sign_probability(0, 0), 1);
}

}  // namespace
}  // namespace postchain::study
