// Winners and warnings, on fabricated values.
#include "tools/measure/experiment/outcome.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/statistics.h"
#include "tools/measure/experiment/verdict.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Values = std::vector<std::optional<double>>;

void fill(Metrics& metrics, const std::string& name, const Values& values) {
    for (size_t i = 0; i < values.size(); ++i)
        set_value(metrics, name, i, values.size(), values[i]);
    find_means(metrics);
}

// HDR-FLIP per frame of each variant (v0, v1, ...) and of the input.
Report fabricate(Kind kind, const std::vector<Values>& variants, const Values& input) {
    Report report;
    report.kind = kind;
    report.reference = "truth";
    report.metrics = {{"hdr_flip", "", Better::lower},
                      {"mse", "", Better::lower},
                      {"sharpness_in_focus", "", Better::one}};
    for (size_t i = 0; i < variants[0].size(); ++i) report.frames.push_back(int(i) + 1);
    for (const Values& values : variants) {
        report.variants.emplace_back();
        report.variants.back().name = concat("v", report.variants.size() - 1);
        fill(report.variants.back().metrics, "hdr_flip", values);
    }
    if (!input.empty()) fill(report.input_metrics, "hdr_flip", input);
    if (kind == Kind::ab) report.comparison = compare_variants(report, {});
    return report;
}

const Values kLow = {.10, .11, .12, .10, .11, .12, .10, .11};
const Values kHigh = {.20, .22, .21, .20, .22, .21, .20, .22};
// Alternately above and below kLow: equal in the mean.
const Values kAround = {.11, .10, .13, .09, .12, .11, .11, .10};

TEST(Outcome, AbIsWonByTheOneThatItsIntervalSays) {
    Report report = fabricate(Kind::ab, {kHigh, kLow}, {});
    state_outcome(report);
    ASSERT_TRUE(report.winner);
    EXPECT_EQ(report.winner->variant, 1u);
    EXPECT_EQ(report.winner->metric, "hdr_flip");
    EXPECT_THAT(report.winner->words, HasSubstr("v1 is closer to the ground truth by HDR-FLIP"));
    report = fabricate(Kind::ab, {kLow, kHigh}, {});
    state_outcome(report);
    EXPECT_EQ(report.winner->variant, 0u);
}

TEST(Outcome, AbWithoutADecisionHasNoWinner) {
    Report open = fabricate(Kind::ab, {kLow, kAround}, {});
    state_outcome(open);
    EXPECT_FALSE(open.winner);
    Report few = fabricate(Kind::ab, {{.2, .2}, {.1, .1}}, {});
    state_outcome(few);
    EXPECT_FALSE(few.winner);
    Report blind = fabricate(Kind::ab, {kHigh, kLow}, {});
    blind.reference = "a";
    state_outcome(blind);
    EXPECT_FALSE(blind.winner);
}

TEST(Outcome, BenchIsWonByTheLowestMeanOfThoseThatDidNotFail) {
    Report report = fabricate(Kind::bench, {{.3}, {.1}, {.2}, {.05}}, {});
    report.variants[3].failure = "frame 2: out of memory";
    state_outcome(report);
    ASSERT_TRUE(report.winner);
    EXPECT_EQ(report.winner->variant, 1u);
    EXPECT_EQ(report.winner->words,
              "v1 has the lowest mean HDR-FLIP of 3 variants: 0.1; the next is v2 with 0.2");
    Report alone = fabricate(Kind::bench, {{.1}}, {});
    state_outcome(alone);
    EXPECT_FALSE(alone.winner);
}

TEST(Outcome, AVariantWorseThanTheInputIsNamed) {
    Report report = fabricate(Kind::bench, {{.3, .3}, {.1, .1}}, {.2, .2});
    state_outcome(report);
    EXPECT_THAT(report.warnings,
                ElementsAre("1 of 2 variants is no better than doing nothing, by mean HDR-FLIP "
                            "(lower is better): v0 0.3, the input 0.2"));
    Report good = fabricate(Kind::bench, {{.1, .1}, {.15, .1}}, {.2, .2});
    state_outcome(good);
    EXPECT_THAT(good.warnings, IsEmpty());
    Report equal = fabricate(Kind::bench, {{.2, .2}, {.1, .1}}, {.2, .2});
    state_outcome(equal);
    EXPECT_THAT(equal.warnings, ElementsAre(HasSubstr("1 of 2 variants is no better")));
}

// Over frames that both have: the variant failed on the frame where the input is bad.
TEST(Outcome, TheInputIsComparedOverTheSameFrames) {
    Report report = fabricate(Kind::bench, {{.3, std::nullopt}, {.1, .1}}, {.2, .9});
    state_outcome(report);
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("v0 0.3, the input 0.2")));
}

TEST(Outcome, FromEightFramesOnTheIntervalDecides) {
    Report report = fabricate(Kind::bench, {kAround, kHigh}, kLow);
    state_outcome(report);
    ASSERT_EQ(report.warnings.size(), 2u);
    EXPECT_THAT(report.warnings[0], HasSubstr("1 of 2 variants is no better than doing nothing"));
    EXPECT_THAT(report.warnings[0], HasSubstr("v1 0.21, the input 0.108"));
    EXPECT_THAT(report.warnings[1], HasSubstr("is not measurably better than doing nothing"));
    EXPECT_THAT(report.warnings[1], HasSubstr(" (t-interval of the difference -0.008"));
}

TEST(Outcome, ManyVariantsAreCountedNotListed) {
    Report report = fabricate(Kind::bench, std::vector<Values>(9, Values{.3}), {.2});
    state_outcome(report);
    ASSERT_EQ(report.warnings.size(), 1u);
    EXPECT_THAT(report.warnings[0], HasSubstr("9 of 9 variants are no better"));
    EXPECT_THAT(report.warnings[0], HasSubstr("v4 0.3"));
    EXPECT_THAT(report.warnings[0], Not(HasSubstr("v5")));
    EXPECT_THAT(report.warnings[0], HasSubstr("; and 4 more"));
}

// From a share of 0.2 to 0.06: 0.2/0.8 over 0.06/0.94 is a factor of 3.92.
TEST(Outcome, ANoisyTruthIsDoubtedWithNumberAndRemedy) {
    Report report = fabricate(Kind::bench, {{.1}, {.15}}, {.2});
    fill(report.truth_noise, kNoiseSigma, {.0123});
    fill(report.truth_noise, "sharpness_in_focus", {.8});
    state_outcome(report);
    EXPECT_THAT(
        report.warnings,
        ElementsAre("sharpness_in_focus is unreliable: the ground truth is noisy (standard "
                    "deviation 0.012 of the displayed luma), and an image without any "
                    "error would have 0.8 instead of 1; give the ground truth about 4 times the "
                    "samples per pixel"));
    Report fine = fabricate(Kind::bench, {{.1}, {.15}}, {.2});
    fill(fine.truth_noise, kNoiseSigma, {.0123});
    fill(fine.truth_noise, "sharpness_in_focus", {.945});
    state_outcome(fine);
    EXPECT_THAT(fine.warnings, IsEmpty());
}

TEST(Outcome, MseThatIsMostlyNoiseIsDoubted) {
    Report report = fabricate(Kind::bench, {{.1}, {.15}}, {.2});
    fill(report.variants[0].metrics, "mse", {.02});
    fill(report.variants[1].metrics, "mse", {.01});
    fill(report.truth_noise, kNoiseSigma, {.05});
    fill(report.truth_noise, "mse", {.004});
    state_outcome(report);
    EXPECT_THAT(report.warnings, IsEmpty());
    fill(report.truth_noise, "mse", {.006});
    state_outcome(report);
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("makes 0.006 of the 0.01 of v1")));
}

}  // namespace
}  // namespace postchain::experiment
