// report.json, report.csv, report.md.
#include "tools/measure/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <sstream>

#include "tests/support/filled_json.h"
#include "tests/support/text_file.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/report_text.h"

namespace postchain::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Every member has a value of its own.
Report filled() {
    Report report;
    report.kind = Kind::ab;
    report.title = "A, \"B\" | C";
    report.command = {"postchain", "ab"};
    report.version = "9.8.7";
    report.input = "in.####.exr";
    report.truth = "truth.####.exr";
    report.no_truth = "why there is none";
    report.reference = "truth";
    report.frames = {10, 11};
    report.scored_frames = {11, 12};
    report.page_frames = {10};
    report.width = 64;
    report.height = 40;
    report.metrics = {{"flip", "FLIP", Better::lower},
                      {"psnr", "dB", Better::higher},
                      {"edges_in_blurred", "ratio", Better::one}};
    report.constants = {{"relmse_epsilon", 0.0125}, {"smape_epsilon", 0.0225}};
    report.exposure_start = -1.5;
    report.exposure_stop = 2.5;
    report.exposures = {-1.5, 0.75, 2.5};
    report.tone_mapper = "aces";
    report.display_transform = "x^(1/2.2)";
    report.renderer = "a device";
    report.software = true;
    report.threads = 6;
    report.precision = "fp16";
    report.seeds = {"motion_blur.seed 23", "joint_blur.seed 29"};
    report.variants.resize(2);
    Variant& variant = report.variants[0];
    variant.name = "one, two";
    variant.sweep = {{"fxaa.preset", "12"}, {"fxaa.hint", "none"}};
    variant.chain_text = "postchain: 1\n";
    variant.chain_hash = 0xabc;
    variant.metrics["flip"] = {{0.25, std::nullopt}, 0.28125};
    variant.timing.emplace();
    variant.timing->frame = 11;
    variant.timing->source = "clock";
    variant.timing->trustworthy = false;
    variant.timing->why_not = "few";
    variant.timing->passes = {{"0.fxaa", false, {1.5, 0.5, 3}}, {"1.dof", true, {2.75, 0.625, 4}}};
    variant.timing->total = {4.25, 1.75, 5};
    variant.split.emplace();
    variant.split->frames = {10};
    variant.split->mse = {0.1, 0.2, 0.3, 0.7};
    variant.split->cross = 0.15;
    variant.split->others["smape"] = {0.11, 0.22, 0.5, std::nullopt};
    variant.split->others["relmse"] = {std::nullopt, 0.33, 0.44, 0.66};
    variant.split->seeds = 16;
    variant.split->converged_noise = 0.001;
    variant.split->convergence = {"fxaa.preset 12 -> 39"};
    variant.split->notes = {"what a split has to say"};
    variant.passes = {"fxaa", "dof", "fxaa"};
    const Elision elided{.pass = 2,
                         .kind = ElisionKind::step,
                         .item = "search",
                         .rule = "off",
                         .fact = {"largest step", 0.31, 0.5, "px", Fact::Relation::below},
                         .saving = {21, 22, 23}};
    Elision blocks = elided;
    blocks.pass = -1;
    blocks.kind = ElisionKind::blocks;
    blocks.fact.relation = Fact::Relation::at_least;
    blocks.work_list = 24;
    blocks.outside = true;
    blocks.taps_per_block = 25;
    Elision again = elided;
    again.fact.value = 0.25;
    variant.elisions = {{10, elided}, {11, again}, {11, blocks}};
    variant.pareto = true;
    report.variants[1].name = "bad";
    report.variants[1].failure = "frame 10: no\nsecond line";
    report.variants[1].resumed = true;
    report.comparison.emplace();
    Comparison& comparison = *report.comparison;
    comparison.metrics = {{"edges_in_blurred",
                           {0.4},
                           8,
                           0.45,
                           Interval{-0.5, 0.55},
                           Interval{-0.6, 0.65},
                           5,
                           Finding::no_measurable_difference,
                           "more words"},
                          {"flip",
                           {0.1, std::nullopt},
                           1,
                           0.125,
                           {},
                           Interval{-1, 1.5},
                           4,
                           Finding::too_few_frames,
                           "words"},
                          {"psnr",
                           {0.2, 0.3},
                           2,
                           0.35,
                           Interval{0.375, 2.25},
                           {},
                           3,
                           Finding::a_better,
                           "other words"}};
    comparison.metrics.resize(4);
    comparison.metrics[3].metric = "tde";  // without a value
    comparison.bootstrap_seed = 31;
    comparison.bootstrap_replicates = 2000;
    comparison.bootstrap_tile_px = 33;
    comparison.claims = "What it claims.";
    comparison.verdict = "Too few.";
    report.images = {{ImageKind::error, -1, 10, "hdr_flip", "images/a.0010.exr", 63, 39, 1},
                     {ImageKind::color, 1, 11, "", "images/b.0011.exr", 62, 38, 3}};
    report.crops = {{10, 1, 2, 3, 4, "why"}};
    report.slice = Slice{17, 5, 26};
    report.notes = {"a note"};
    report.warnings = {"a warning"};
    report.input_metrics["flip"] = {{0.5, 0.75}, 0.625};
    report.input_metrics["psnr"] = {{30, 31}, 30.5};
    report.truth_noise[kNoiseSigma] = {{0.01, 0.02}, 0.015};
    report.truth_noise["flip"] = {{0.1, 0.3}, 0.2};
    report.truth_noise["psnr"] = {{40, 41}, 40.5};
    report.winner = Winner{1, "flip", "bad has won"};
    report.under = {"flip=0.1: one, two (4.25 ms)"};
    report.pareto_metric = "flip";
    return report;
}

const std::string kExpected = POSTCHAIN_SOURCE_DIR "/tests/measure/report/expected.";

void collect_keys(const Json& json, std::set<std::string>& keys) {
    for (const auto& [key, value] : json.items()) {
        if (json.is_object()) keys.insert(key);
        if (value.is_structured()) collect_keys(value, keys);
    }
}

TEST(ReportJson, EveryKeyIsInTheDocument) {
    const Json json = report_json(filled());
    const std::string text = test::read_text(POSTCHAIN_SOURCE_DIR "/docs/report.md");
    ASSERT_FALSE(text.empty());
    std::set<std::string> keys;
    collect_keys(json, keys);
    // Names that are data, not keys of the format.
    for (const char* data : {"flip", "psnr", "smape", "relmse", "relmse_epsilon", "smape_epsilon",
                             "fxaa.preset", "fxaa.hint"})
        keys.erase(data);
    EXPECT_GT(keys.size(), 70u);
    for (const auto& key : keys)
        EXPECT_NE(text.find("`" + key + "`"), text.npos) << key << " is not in docs/report.md";
}

TEST(ReportJson, HasEveryMemberUnderItsName) {
    test::expect_text_of(kExpected + "json", test::filled_json(report_json(filled())) + "\n");
    Report bare = filled();
    bare.kind = Kind::bench;
    bare.variants.clear();
    bare.input_metrics.clear();
    bare.truth_noise.clear();
    const Json json = report_json(bare);
    EXPECT_EQ(json.at("kind"), "bench");
    for (const char* key : {"input_metrics", "truth_noise"})
        EXPECT_TRUE(json.at(key).is_null()) << key;
    for (const char* key : {"truth", "winner", "comparison", "slice", "no_truth", "pareto_metric"})
        EXPECT_TRUE(report_json(Report()).at(key).is_null()) << key;
}

TEST(ReportJson, NamesOfValues) {
    std::string names;
    for (int i = 0; i < 4; ++i) names += concat(name_of(Finding(i)), " ");
    for (int i = 0; i < 6; ++i) names += concat(name_of(ImageKind(i)), " ");
    for (const char* reference : {"truth", "converged", "a"})
        for (int i = 0; i < 3; ++i) names += concat("\n", words_of(Better(i), reference));
    EXPECT_EQ(names,
              "too_few_frames no_measurable_difference a_better b_better input truth color error "
              "converged slice "
              "\nlower is better\nhigher is better\nbest at 1"
              "\nlower is better\nhigher is better\nbest at 1"
              "\nlower is more alike\nhigher is more alike\nalike at 1");
}

TEST(ReportJson, NonFiniteNumbersAndForeignBytesStillMakeJson) {
    Report report = filled();
    report.variants[0].metrics["flip"].mean = std::numeric_limits<double>::infinity();
    report.variants[0].metrics["flip"].frames[0] = std::numeric_limits<double>::quiet_NaN();
    report.input = "f\xfcr.exr";
    const Json json = Json::parse(io::json_text(report_json(report)), nullptr, false);
    ASSERT_FALSE(json.is_discarded());
    EXPECT_TRUE(json["variants"][0]["metrics"]["flip"]["mean"].is_null());
}

TEST(ReportJson, PartsOfAVariantComeBack) {
    const Report report = filled();
    const Variant& variant = report.variants[0];
    const Json timing = variant.timing, split = variant.split;
    EXPECT_EQ(Json(timing.get<Timing>()), timing);
    EXPECT_EQ(Json(split.get<ErrorSplit>()), split);
    for (const auto& [frame, elision] : variant.elisions)
        EXPECT_EQ(json_of(elision_from(json_of(elision))), json_of(elision)) << frame;
    EXPECT_FALSE(Json(nullptr).get<std::optional<Timing>>());
    EXPECT_THROW(Json::parse("{}").get<Timing>(), Json::exception);
    EXPECT_THROW(Json::parse("[]").get<ErrorSplit>(), Json::exception);
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

TEST(ReportCsv, EveryRowHasEveryColumn) {
    const std::string text = report_as_csv(filled());
    test::expect_text_of(kExpected + "csv", text);
    Report report = filled();  // without commas in a field
    report.variants[0].name = "one";
    const auto lines = lines_of(report_as_csv(report));
    for (const auto& line : lines) EXPECT_EQ(std::ranges::count(line, ','), 15) << line;
}

TEST(ReportMarkdown, TablesVerdictAndFailures) {
    const std::string text = report_as_markdown(filled());
    test::expect_text_of(kExpected + "md", text);
    Report scored = filled();
    scored.comparison.reset();
    EXPECT_THAT(report_as_markdown(scored), HasSubstr("\nbad has won.\n"));
    Report alike = filled();
    alike.truth.reset();
    for (const auto& [reference, heading] :
         {std::pair{"a", "the first chain"}, {"converged", "the same filter converged"}}) {
        alike.reference = reference;
        const std::string other = report_as_markdown(alike);
        EXPECT_THAT(other, HasSubstr(concat("\n## Against ", heading, ", mean over frames\n")));
        EXPECT_THAT(other, HasSubstr("\n| truth | none: why there is none |\n"));
        EXPECT_THAT(other, HasSubstr(" 3 exposures, from the unfiltered input |\n"));
        EXPECT_THAT(other,
                    HasSubstr(*reference == 'a' ? "\n| flip | lower is more alike | 0.28125 |"
                                                : "\n| flip | lower is better | 0.28125 |"));
    }
    // Every row of a table has as many bars as the one before it in that table.
    std::ptrdiff_t bars = 0;
    for (const auto& line : lines_of(text)) {
        const auto here = line.starts_with('|') ? std::count(line.begin(), line.end(), '|') : 0;
        EXPECT_TRUE(bars == 0 || here == 0 || here == bars) << line;
        bars = here;
    }
}

TEST(ReportMarkdown, BenchPutsErrorBesideTime) {
    Report report = filled();
    report.kind = Kind::bench;
    report.comparison.reset();
    report.pareto_metric = "hdr_flip";
    report.variants[0].metrics["hdr_flip"].mean = 0.25;
    report.variants[0].metrics["mse"].mean = 0.125;
    report.variants.insert(report.variants.begin(), report.variants[0]);
    report.variants[0].name = "slow";
    report.variants[0].timing->total.median_ms = 20;
    report.variants[0].pareto = false;
    test::expect_text_of(kExpected + "bench.md", report_as_markdown(report));
    // One that was not timed has no place in the table; of many variants each has a row of its
    // metrics.
    report.variants[1].timing.reset();
    EXPECT_THAT(report_as_markdown(report), Not(HasSubstr("| one, two | 4.25 |")));
    report.variants.resize(5, report.variants[0]);
    report.reference = "a";
    EXPECT_THAT(report_as_markdown(report),
                HasSubstr("| variant | flip (lower is more alike) |\n|---|---|\n"
                          "| slow | 0.28125 |\n| one, two | 0.28125 |\n| bad |  |\n"));
    report.variants.resize(1);
    report.variants[0].elisions.clear();
    EXPECT_THAT(report_as_markdown(report), HasSubstr("Nothing: every plan is whole."));
}

// Names of others are text: no HTML in Markdown, no formulas in a spreadsheet.
TEST(ReportText, NamesAreOnlyText) {
    Report report = filled();
    const std::string html = "<img src=x onerror=alert(1)>&amp;";
    report.title = "title " + html;
    report.input = "in " + html;
    report.notes = {"note " + html};
    report.variants[1].name = "bad " + html;
    report.variants[1].failure = "failed " + html;
    const std::string text = report_as_markdown(report);
    EXPECT_EQ(text.find('<'), std::string::npos) << text.substr(text.find('<'));
    for (const char* place : {"# title ", "| in ", "- note ", "bad ", "failed "})
        EXPECT_THAT(text,
                    HasSubstr(place + std::string("&lt;img src=x onerror=alert(1)>&amp;amp;")));

    // Neither a terminal nor a reader sees anything else than these characters.
    const std::string marks = "a\x1b[31m\xc2\x9b\xe2\x80\xae\xff\n# b\r| c\\| d";
    const std::string shown = "a\\\\x1b[31m\\\\u{9b}\\\\u{202e}\\\\xff\\\\n# b\\\\x0d";
    report.title = report.input = report.notes[0] = report.variants[1].name = marks;
    const std::string plain = report_as_markdown(report);
    EXPECT_THAT(plain, HasSubstr("# " + shown + "| c\\\\| d\n"));
    EXPECT_THAT(plain, HasSubstr("| input | " + shown + "\\| c\\\\\\| d |\n"));
    EXPECT_THAT(plain, HasSubstr("- " + shown));
    for (const char* raw : {"\x1b", "\xc2\x9b", "\xe2\x80\xae", "\xff", "\r", "\n# b"})
        EXPECT_EQ(plain.find(raw), std::string::npos) << raw;

    for (const char* name : {"=1+1", "+1", "-1", "@SUM(A1)", "\tx", "=HYPERLINK(\"a\",\"b\")"}) {
        report.variants[0].name = name;
        const std::string line = lines_of(report_as_csv(report))[1];
        EXPECT_TRUE(line.starts_with("'") || line.starts_with("\"'")) << line;
    }
    report.variants[0].name = "a\x1b[31m\xe2\x80\xae\nb";
    EXPECT_TRUE(lines_of(report_as_csv(report))[1].starts_with("a\\x1b[31m\\u{202e}\\nb,"));
    report.variants[0].name = "a=1";
    EXPECT_TRUE(lines_of(report_as_csv(report))[1].starts_with("a=1,"));
}

}  // namespace
}  // namespace postchain::report
