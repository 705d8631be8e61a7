// The report of a study, from fabricated results of its tasks.
#include "tools/measure/study/study_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "passes/registry.h"
#include "tests/support/filled_json.h"
#include "tests/support/text_file.h"
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

// Every member has a value of its own.
StudyReport filled() {
    StudyReport report;
    report.title = "a | title";
    report.version = "9.8.7";
    report.kind = report::Kind::bench;
    report.variants = {"low", "high", "along"};
    report.chain_texts = {"postchain: 1  # low\n", "postchain: 1  # high\n", "postchain: 1\n"};
    report.revisions = {"first", "second-dirty"};
    report.pairs = {{0, 1}, {2, 0}, {1, 2}};
    report.equal = {Equal::time, Equal::samples, Equal::unsaid};
    report.time_ratios = {1.5, std::nullopt, std::nullopt};
    report.scenes = {
        {"s", "x", "s.####.exr", "truth.####.exr", {10, 11, 14}, 64, 40, {"r/index.html"}, ""},
        {"t", "y", "t.####.exr", "", {}, 0, 0, {"u/index.html", "v/index.html"}, "dark"}};
    const auto result = [](double n, Decision decision) {
        PairResult made;
        made.mean = n + 0.125;
        made.interval = report::Interval{n + 0.25, n + 0.375};
        made.difference = Probability{n + 0.5, n + 0.625};
        made.margin = n + 0.75;
        made.equivalence = Probability{n + 0.875, n + 0.9375};
        made.families = int(n) + 11;
        made.nearer = int(n) + 7;
        made.farther = int(n) + 4;
        made.scenes = int(n) + 22;
        made.scenes_nearer = int(n) + 18;
        made.sign_probability = n + 0.0625;
        made.decision = decision;
        made.words = concat("words of ", n);
        return made;
    };
    PairResult none;
    none.words = "no scene has a value";
    report.tables = {
        {{"hdr_flip", "HDR-FLIP in words", report::Better::lower},
         {{"s", "x", 1, {0.5, 0.25, 0.75}, {0.25, 0.125, -0.5}}},
         {{"x", "", 3, {0.5625, 0.3125, 0.8125}, {0.375, std::nullopt, 0.0625}}},
         {0.53125, 0.28125, std::nullopt},
         1,
         {result(1, Decision::a), result(2, Decision::equal), none}},
        {{"psnr", "dB", report::Better::higher},
         {},
         {},
         {30, 31, 32},
         {},
         {result(3, Decision::b), result(4, Decision::not_decided), result(5, Decision::too_few)}}};
    report.notes = {"a note", "another"};
    return report;
}

TEST(StudyReport, HasEveryMemberUnderItsName) {
    const std::string expected = POSTCHAIN_SOURCE_DIR "/tests/measure/study/expected.";
    test::expect_text_of(expected + "json", test::filled_json(report_json(filled())) + "\n");
    test::expect_text_of(expected + "csv", report_as_csv(filled()));
    test::expect_text_of(expected + "md", report_as_markdown(filled()));
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
