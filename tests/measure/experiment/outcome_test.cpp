// Winners and warnings, on fabricated values.
#include "tools/measure/experiment/outcome.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/statistics.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::AllOf;
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

Report stated(Report report) {
    state_outcome(report);
    return report;
}

const Values kLow = {.10, .11, .12, .10, .11, .12, .10, .11};
const Values kHigh = {.20, .22, .21, .20, .22, .21, .20, .22};
// Alternately above and below kLow: equal in the mean.
const Values kAround = {.11, .10, .13, .09, .12, .11, .11, .10};

TEST(Outcome, AbIsWonByTheOneThatItsIntervalSays) {
    const Report report = stated(fabricate(Kind::ab, {kHigh, kLow}, {}));
    ASSERT_TRUE(report.winner);
    EXPECT_EQ(report.winner->variant, 1u);
    EXPECT_EQ(report.winner->metric, "hdr_flip");
    EXPECT_THAT(report.winner->words, HasSubstr("v1 is closer to the ground truth by HDR-FLIP"));
    EXPECT_EQ(stated(fabricate(Kind::ab, {kLow, kHigh}, {})).winner->variant, 0u);
}

TEST(Outcome, AbWithoutADecisionHasNoWinner) {
    EXPECT_FALSE(stated(fabricate(Kind::ab, {kLow, kAround}, {})).winner);
    EXPECT_FALSE(stated(fabricate(Kind::ab, {{.2, .2}, {.1, .1}}, {})).winner);
    Report blind = fabricate(Kind::ab, {kHigh, kLow}, {});
    blind.reference = "a";
    EXPECT_FALSE(stated(blind).winner);
}

TEST(Outcome, BenchIsWonByTheLowestMeanOfThoseThatDidNotFail) {
    Report report = fabricate(Kind::bench, {{.3}, {.1}, {.2}, {.05}}, {});
    report.variants[3].failure = "frame 2: out of memory";
    report = stated(report);
    ASSERT_TRUE(report.winner);
    EXPECT_EQ(report.winner->variant, 1u);
    EXPECT_EQ(report.winner->words,
              "v1 has the lowest mean HDR-FLIP of 3 variants: 0.1; the next is v2 with 0.2");
    EXPECT_FALSE(stated(fabricate(Kind::bench, {{.1}}, {})).winner);
}

TEST(Outcome, AVariantWorseThanTheInputIsNamed) {
    const auto warnings = [](const std::vector<Values>& variants, const Values& input) {
        return stated(fabricate(Kind::bench, variants, input)).warnings;
    };
    EXPECT_THAT(warnings({{.3, .3}, {.1, .1}}, {.2, .2}),
                ElementsAre("1 of 2 variants is no better than doing nothing, by mean HDR-FLIP "
                            "(lower is better): v0 0.3, the input 0.2"));
    EXPECT_THAT(warnings({{.1, .1}, {.15, .1}}, {.2, .2}), IsEmpty());
    EXPECT_THAT(warnings({{.2, .2}, {.1, .1}}, {.2, .2}),
                ElementsAre(HasSubstr("1 of 2 variants is no better")));
    // Over frames that both have: the variant failed on the frame where the input is bad.
    EXPECT_THAT(warnings({{.3, std::nullopt}, {.1, .1}}, {.2, .9}),
                ElementsAre(HasSubstr("v0 0.3, the input 0.2")));
    // Many are counted, not listed.
    EXPECT_THAT(warnings(std::vector<Values>(9, Values{.3}), {.2}),
                ElementsAre(AllOf(HasSubstr("9 of 9 variants are no better"), HasSubstr("v4 0.3"),
                                  Not(HasSubstr("v5")), HasSubstr("; and 4 more"))));
}

TEST(Outcome, FromEightFramesOnTheIntervalDecides) {
    EXPECT_THAT(stated(fabricate(Kind::bench, {kAround, kHigh}, kLow)).warnings,
                ElementsAre(AllOf(HasSubstr("1 of 2 variants is no better than doing nothing"),
                                  HasSubstr("v1 0.21, the input 0.108")),
                            AllOf(HasSubstr("is not measurably better than doing nothing"),
                                  HasSubstr(" (t-interval of the difference -0.008"))));
}

// From a share of 0.2 to 0.06: 0.2/0.8 over 0.06/0.94 is a factor of 3.92.
TEST(Outcome, ANoisyTruthIsDoubtedWithNumberAndRemedy) {
    const auto warnings = [](double sharpness) {
        Report report = fabricate(Kind::bench, {{.1}, {.15}}, {.2});
        fill(report.truth_noise, kNoiseSigma, {.0123});
        fill(report.truth_noise, "sharpness_in_focus", {sharpness});
        return stated(report).warnings;
    };
    EXPECT_THAT(
        warnings(.8),
        ElementsAre("sharpness_in_focus is unreliable: the ground truth is noisy (standard "
                    "deviation 0.012 of the displayed luma), and an image without any "
                    "error would have 0.8 instead of 1; give the ground truth about 4 times the "
                    "samples per pixel"));
    EXPECT_THAT(warnings(.945), IsEmpty());
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
