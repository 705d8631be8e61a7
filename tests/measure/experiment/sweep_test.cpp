// Sweeps of a chain's values, and choices among the variants.
#include "tools/measure/experiment/sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/measure/experiment/support.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::experiment {

using namespace report;
namespace {

using test::sweep;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::vector<std::string> names(const std::vector<NamedChain>& variants) {
    std::vector<std::string> list;
    for (const auto& variant : variants) list.push_back(variant.name);
    return list;
}

TEST(Sweeps, ProductInOrderTheLastFastest) {
    const auto variants = test::must(sweep({"motion_blur.samples=5,9", "fxaa.preset=10,12,39"}));
    EXPECT_THAT(
        names(variants),
        ElementsAre("motion_blur.samples=5 fxaa.preset=10", "motion_blur.samples=5 fxaa.preset=12",
                    "motion_blur.samples=5 fxaa.preset=39", "motion_blur.samples=9 fxaa.preset=10",
                    "motion_blur.samples=9 fxaa.preset=12",
                    "motion_blur.samples=9 fxaa.preset=39"));
    EXPECT_THAT(variants[4].chain.text(), AllOf(HasSubstr("samples=9"), HasSubstr("preset=12")));
}

TEST(Sweeps, EqualChainsStandOnceAndNoSweepIsTheChain) {
    EXPECT_EQ(sweep({"motion_blur.samples=5,5,7"})->size(), 2u);
    EXPECT_EQ(sweep({})->size(), 1u);
    EXPECT_THAT((*sweep({}, 64, {"motion_blur.samples=7"}))[0].chain.text(),
                HasSubstr("samples=7"));
}

// The last one would win, and the variants' names would be wrong.
TEST(Sweeps, TwoOfOneValueAreRefused) {
    for (const char* again : {"motion_blur.samples=5", "passes[0].samples=5,9"}) {
        const auto twice = sweep({"motion_blur.samples=5,7", again});
        EXPECT_EQ(twice.status().code(), StatusCode::usage) << again;
        EXPECT_THAT(test::error_of(twice),
                    AllOf(HasSubstr("one sweep"), HasSubstr("motion_blur.samples")));
    }
    EXPECT_EQ(sweep({"motion_blur.samples=5,7", "passes[1].preset=10,12"})->size(), 4u);
    // A sweep overrides --set, and its name shows the swept value.
    EXPECT_EQ(sweep({"motion_blur.samples=5,7"}, 64, {"motion_blur.samples=9"})->size(), 2u);
}

TEST(Sweeps, ExplosionsAreRefused) {
    const std::vector<std::string> six = {"motion_blur.samples=5,7,9", "fxaa.preset=10,12"};
    EXPECT_EQ(sweep(six, 5).status().code(), StatusCode::usage);
    EXPECT_TRUE(sweep(six, 6).ok());
}

TEST(Sweeps, BadTextsAndValuesAreUsageErrors) {
    for (const char* text : {"motion_blur.samples", "=5", "motion_blur.samples=5,,9",
                             "motion_blur.samples=", "motion_blur.samples=4",
                             "motion_blur.samples=many", "motion_blur.sampels=5,9"}) {
        const auto wrong = sweep({text});
        EXPECT_EQ(wrong.status().code(), StatusCode::usage) << text;
        EXPECT_THAT(test::error_of(wrong),
                    AllOf(HasSubstr("{sweep}"_keyed), Not(HasSubstr("{set}"_keyed))));
    }
}

Report choices() {
    // time, error:        0: 1 ms, 0.9   1: 2 ms, 0.5   2: 3 ms, 0.6   3: 4 ms, 0.1   4: failed
    Report report;
    const double times[] = {1, 2, 3, 4, 0.5}, errors[] = {0.9, 0.5, 0.6, 0.1, 0.05};
    for (int i = 0; i < 5; ++i) {
        Variant variant;
        variant.name = concat("v", i);
        variant.chain_text = concat("chain ", i);
        variant.timing.emplace();
        variant.timing->total.median_ms = times[i];
        variant.timing->total.n = 5;
        variant.metrics["flip"].mean = errors[i];
        if (i == 4) variant.failure = "frame 1: no";
        report.variants.push_back(variant);
    }
    return report;
}

TEST(Choices, ParetoSetLeavesOutWhatIsBeatenInBoth) {
    Report report = choices();
    mark_pareto(report, "flip");
    std::vector<bool> pareto;
    for (const auto& variant : report.variants) pareto.push_back(variant.pareto);
    EXPECT_EQ(pareto, (std::vector<bool>{true, true, false, true, false}));
    // Equal in both: both stay.
    report.variants[2].timing->total.median_ms = 2;
    report.variants[2].metrics["flip"].mean = 0.5;
    mark_pareto(report, "flip");
    EXPECT_TRUE(report.variants[1].pareto && report.variants[2].pareto);
    // Equally fast but worse: beaten.
    report.variants[2].metrics["flip"].mean = 0.51;
    mark_pareto(report, "flip");
    EXPECT_FALSE(report.variants[2].pareto);
    // Measured too few times: neither in the set nor better than others.
    report.variants[1].timing->total.n = 4;
    mark_pareto(report, "flip");
    EXPECT_FALSE(report.variants[1].pareto);
    EXPECT_TRUE(report.variants[2].pareto);
    // Without a time, without a value.
    report.variants[3].timing.reset();
    report.variants[0].metrics.clear();
    mark_pareto(report, "flip");
    EXPECT_FALSE(report.variants[3].pareto || report.variants[0].pareto);
}

TEST(Choices, CheapestUnderALimitIsWritten) {
    for (const double limit : {0.6, 0.5}) {
        const test::TempFolder folder;
        Report report = choices();
        report.folder = folder.path();
        auto met = choose_under(report, {{"flip", limit}});
        ASSERT_TRUE(met.ok());
        EXPECT_TRUE(*met);
        EXPECT_EQ(test::read_text(folder.path("under_flip.yaml")), "chain 1");
        EXPECT_THAT(report.under[0], HasSubstr("v1 with 0.5 in 2 ms"));
        met = choose_under(report, {{"flip", 0.01}});
        EXPECT_FALSE(*met);
        EXPECT_THAT(report.under[1], HasSubstr("no variant; the closest is v3 with 0.1"));
        // Neither one without a time nor one without a value is chosen.
        report.variants[1].timing.reset();
        std::filesystem::remove(folder.path("under_flip.yaml"));
        EXPECT_TRUE(*choose_under(report, {{"flip", 0.6}}));
        EXPECT_THAT(report.under[2], HasSubstr("v2 with 0.6 in 3 ms"));
        for (auto& variant : report.variants) variant.metrics.clear();
        EXPECT_FALSE(*choose_under(report, {{"flip", 0.6}}));
        EXPECT_THAT(report.under[3], HasSubstr("no variant has a value"));
    }
}

TEST(Limits, FormMetricAndDirectionAreChecked) {
    const auto columns = metric_columns(Kind::ab, true);
    EXPECT_EQ(test::must(parse_limit("under", "flip=0.1", columns)).metric, "flip");
    for (const auto& [text, said] : {std::pair{"flip=x", "METRIC=NUMBER"},
                                     {"filp=0.1", "did you mean 'flip'"},
                                     {"psnr=30", "is not an error"},
                                     {"edges_in_blurred=1", "is not an error"}})
        EXPECT_THAT(test::error_of(parse_limit("under", text, columns)), HasSubstr(said));
    Report report = choices();
    EXPECT_EQ(exceeding(report, {{"flip", 0.5}}).size(), 2u);
    EXPECT_TRUE(exceeding(report, {{"flip", 0.9}}).empty());
    report.variants[0].metrics.clear();
    report.variants[2].metrics["flip"].mean.reset();
    EXPECT_TRUE(exceeding(report, {{"flip", 0.5}}).empty());
    report.variants[3].metrics["nonfinite"].mean = 2;
    EXPECT_THAT(exceeding(report, {{"flip", 0.5}}), ::testing::ElementsAre(HasSubstr("v3: ")));
}

TEST(Limits, GiveTheExitCode) {
    Report report = choices();
    std::vector<std::string> broken;
    const auto code = [&](double limit, bool met) {
        return exit_code_of(report, {{"flip", limit}}, met, broken);
    };
    EXPECT_EQ(code(0.5, true), kExitThreshold);  // also if a variant failed
    EXPECT_EQ(broken.size(), 2u);
    EXPECT_EQ(code(0.9, false), kExitSomeFailed);
    EXPECT_TRUE(broken.empty());
    report.variants[4].failure.clear();
    EXPECT_EQ(code(0.9, false), kExitThreshold);
    EXPECT_EQ(code(0.9, true), kExitOk);
}

}  // namespace
}  // namespace postchain::experiment
