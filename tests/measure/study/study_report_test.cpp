// The report of a study, from fabricated results of its tasks.
#include "tools/measure/study/study_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "passes/registry.h"
#include "tools/measure/study/study_reader.h"

namespace postchain::study {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Study bench_of_two_chains() {
    std::string text =
        "postchain_study: 1\nkind: bench\n"
        "chains: {low: [fxaa: {preset: 12}], high: [fxaa: {preset: 39}], along: [fxaa: {mode: "
        "directional}]}\n"
        "questions: [{pair: [low, high], equal: time}, [low, along]]\nscenes:\n";
    for (const char* name : {"s", "t", "u"})
        text +=
            concat("  - {name: ", name, ", input: '", name, ".####.exr', truth: 'b.####.exr'}\n");
    StudyFile file =
        read_study(text, "study.yaml", builtin_passes(), paths_beside("study.yaml"), "1");
    EXPECT_EQ(text_of(file.diagnostics), "");
    return std::move(file.study);
}

// HDR-FLIP 0.5, 0.4 and 0.3; the times in ms.
TaskResult result(const std::string& revision, double low, double high) {
    TaskResult made;
    made.revision = revision;
    made.frames = {1};
    made.variants = {{"low", {{"hdr_flip", {0.5}}}, low},
                     {"high", {{"hdr_flip", {0.4}}}, high},
                     {"along", {{"hdr_flip", {0.3}}}, 7}};
    return made;
}

TEST(StudyReport, TimesOfEqualTimeAreTheGeometricMeanOfTheirRatios) {
    const Study study = bench_of_two_chains();
    const auto report = [&](double second, double third) {
        return make_report(study,
                           {result("r", 2, 4), result("r", 2, second), result("r", 1, third)});
    };
    const StudyReport equal = report(1, 1);  // 2, 1/2, 1
    EXPECT_DOUBLE_EQ(*equal.time_ratios[0], 1);
    EXPECT_FALSE(equal.time_ratios[1]);  // does not say equal time
    EXPECT_EQ(equal.condition(0), "equal time: 1");
    EXPECT_EQ(equal.condition(1), "");
    const StudyReport slower = report(4, 2);      // 2, 2, 2
    EXPECT_DOUBLE_EQ(*slower.time_ratios[0], 2);  // B / A
    EXPECT_EQ(slower.condition(0), "not equal time: 2");
    EXPECT_THAT(slower.verdict(),
                ElementsAre(HasSubstr("high against low (not equal time: 2), HDR-FLIP: "),
                            HasSubstr("along against low, HDR-FLIP: ")));
}

TEST(StudyReport, ASceneThatFailedIsInNoTable) {
    TaskResult failed;
    failed.failure = "the ground truth has no file";
    const StudyReport report =
        make_report(bench_of_two_chains(), {result("first", 2, 4), failed, result("second", 2, 4)});
    EXPECT_EQ(report.failures(), 1u);
    EXPECT_EQ(report.scenes[1].failure, failed.failure);
    EXPECT_THAT(report.revisions, ElementsAre("first", "second"));
    ASSERT_TRUE(report.table("hdr_flip"));
    EXPECT_EQ(report.table("hdr_flip")->scenes.size(), 2u);
    EXPECT_NEAR(*report.table("hdr_flip")->scenes[1].gains[1], 0.2, 1e-12);
    EXPECT_THAT(report_as_markdown(report), HasSubstr(failed.failure));
}

}  // namespace
}  // namespace postchain::study
