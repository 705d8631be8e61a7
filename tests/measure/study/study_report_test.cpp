// The report of a study, from fabricated results of its tasks.
#include "tools/measure/study/study_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "passes/registry.h"
#include "tools/measure/study/study_reader.h"

namespace postchain::study {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

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

TEST(StudyReport, TheCsvHasTheIntervalsOfAllQuestions) {
    std::vector<TaskResult> results(3, result("r", 1, 1));
    results[1].variants[1].metrics["hdr_flip"] = {0.38};
    results[2].variants[1].metrics["hdr_flip"] = {0.42};
    const StudyReport report = make_report(bench_of_two_chains(), results);
    const auto& pairs = report.table("hdr_flip")->pairs;
    const std::string csv = report_as_csv(report);
    EXPECT_THAT(csv, HasSubstr("hdr_flip,scene,\"t\",\"t\",0.5,0.38,0.3,0.12,0.2\n"));
    const auto line = [&](const char* row, auto value) {
        return concat("hdr_flip,", row, ",\"\",\"\",,,,", io::json_text(value(pairs[0])), ",",
                      io::json_text(value(pairs[1])), "\n");
    };
    EXPECT_THAT(csv, HasSubstr(line("low", [](const auto& pair) { return pair.interval->low; })));
    EXPECT_THAT(csv, HasSubstr(line("high", [](const auto& pair) { return pair.interval->high; })));
    EXPECT_NEAR(pairs[0].interval->high - pairs[0].interval->low, 2 * 4.302653 * 0.0115470, 1e-6);
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

Study ab_of_two_pairs() {
    StudyFile file = read_study(
        "postchain_study: 1\nchains: {a: [fxaa], b: paper, c: fast}\n"
        "questions: [{pair: [a, b], equal: time}, {pair: [a, c], equal: time}]\nscenes:\n"
        "  - {name: s, input: 's.####.exr', truth: 'b.####.exr'}\n",
        "study.yaml", builtin_passes(), paths_beside("study.yaml"), "1");
    EXPECT_EQ(text_of(file.diagnostics), "");
    return std::move(file.study);
}

TEST(StudyReport, APairMeasuredAloneGivesItsOwnTimeRatio) {
    const Study study = ab_of_two_pairs();
    const auto timed = [](const std::optional<double>& of_a, const std::optional<double>& of_b) {
        TaskResult made;
        made.renderer = of_b ? "one" : "another";
        made.variants = {{"a", {{"hdr_flip", {0.5}}}, of_a}, {"b", {{"hdr_flip", {0.4}}}, of_b}};
        return made;
    };
    const StudyReport report = make_report(study, {timed(2, 3), timed(2, 8)});
    EXPECT_DOUBLE_EQ(*report.time_ratios[0], 1.5);
    EXPECT_DOUBLE_EQ(*report.time_ratios[1], 4);
    EXPECT_EQ(report.notes[0], "Measured on one.");
    EXPECT_THAT(report.notes, Not(Contains(HasSubstr("different devices"))));
    // A task without a time gives no ratio, whichever side lacks it.
    const StudyReport partly = make_report(study, {timed(std::nullopt, 3), timed(2, std::nullopt)});
    EXPECT_EQ(partly.condition(0), "equal time, not measured");
    EXPECT_EQ(partly.condition(1), "equal time, not measured");
    EXPECT_THAT(partly.notes, Contains(HasSubstr("different devices")));
    EXPECT_EQ(make_report(study, {timed(0, 3), timed(2, 0)}).condition(0),
              "equal time, not measured");
}

TEST(StudyReport, AFailureOfSeveralTasksStandsOnce) {
    TaskResult dark, empty;
    dark.failure = "no light";
    empty.failure = "no frame";
    const Study study = ab_of_two_pairs();
    EXPECT_EQ(make_report(study, {dark, dark}).scenes[0].failure, "no light");
    EXPECT_EQ(make_report(study, {dark, empty}).scenes[0].failure, "no light; no frame");
}

// RFC 4180, and no formulas.
TEST(StudyReport, TextsOfTheTableAreQuoted) {
    Study study = ab_of_two_pairs();
    study.scenes[0].family = "=1+\"2\"";
    TaskResult made;
    made.variants = {{"a", {{"hdr_flip", {0.5}}}, 1.0}, {"b", {{"hdr_flip", {0.4}}}, 1.0}};
    EXPECT_THAT(report_as_csv(make_report(study, {made, made})), HasSubstr("\"'=1+\"\"2\"\"\""));
}

}  // namespace
}  // namespace postchain::study
