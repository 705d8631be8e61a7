// report.json, report.csv, report.md.
#include "tools/measure/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <sstream>

#include "tests/support/text_file.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/report_text.h"

namespace postchain::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Every member filled with something of its own.
Report filled() {
    Report report;
    report.kind = Kind::ab;
    report.title = "A, \"B\" | C";
    report.command = {"postchain", "ab"};
    report.version = "9";
    report.input = "in.####.exr";
    report.truth = "truth.####.exr";
    report.reference = "truth";
    report.frames = {10, 11};
    report.page_frames = {10};
    report.width = 64;
    report.height = 40;
    report.metrics = {{"flip", "FLIP", Better::lower}, {"psnr", "dB", Better::higher}};
    report.constants = {{"relmse_epsilon", 0.01}};
    report.exposures = {-1, 2};
    report.tone_mapper = "aces";
    report.variants.resize(2);
    Variant& variant = report.variants[0];
    variant.name = "one, two";
    variant.sweep = {{"fxaa.preset", "10"}};
    variant.chain_text = "postchain: 1\n";
    variant.chain_hash = 0xabc;
    variant.metrics["flip"] = {{0.25, std::nullopt}, 0.25};
    variant.timing.emplace();
    variant.timing->frame = 11;
    variant.timing->source = "clock";
    variant.timing->trustworthy = false;
    variant.timing->why_not = "few";
    variant.timing->passes = {{"0.fxaa", false, {1.5, 0.5, 3}}, {"1.dof", true, {}}};
    variant.timing->total = {1.5, 0.5, 3};
    variant.split.emplace();
    variant.split->frames = {10};
    variant.split->mse = {0.1, 0.2, 0.3, 0.7};
    variant.split->cross = 0.1;
    variant.split->others["smape"].model = 0.5;
    variant.split->seeds = 16;
    variant.split->converged_noise = 0.001;
    variant.split->convergence = {"fxaa.preset 12 -> 39"};
    variant.split->notes = {"what a split has to say"};
    variant.passes = {"fxaa"};
    variant.elisions.emplace_back(
        10, Elision{.pass = 0, .rule = "rule", .fact = {"reason"}, .saving = {1, 2, 3}});
    report.variants[1].name = "bad";
    report.variants[1].failure = "frame 10: no\nsecond line";
    report.comparison.emplace();
    report.comparison->metrics.push_back({"flip",
                                          {0.1, std::nullopt},
                                          1,
                                          0.1,
                                          std::nullopt,
                                          Interval{-1, 1},
                                          4,
                                          Finding::too_few_frames,
                                          "words"});
    report.comparison->verdict = "Too few.";
    StoredImage image;
    image.path = "images/a.0010.exr";
    report.images = {image};
    report.crops = {{10, 1, 2, 3, 4, "why"}};
    report.notes = {"a note"};
    report.warnings = {"a warning"};
    report.input_metrics["flip"] = {{0.5, 0.75}, 0.625};
    report.truth_noise[kNoiseSigma] = {{0.01, 0.02}, 0.015};
    report.truth_noise["flip"] = {{0.1, 0.3}, 0.2};
    report.winner = Winner{1, "flip", "bad has won"};
    return report;
}

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
    for (const char* data : {"flip", "smape", "relmse_epsilon", "fxaa.preset"}) keys.erase(data);
    EXPECT_GT(keys.size(), 70u);
    for (const auto& key : keys)
        EXPECT_THAT(text, HasSubstr("`" + key + "`")) << "not in docs/report.md";
}

TEST(ReportJson, ValuesAndNulls) {
    const Json json = report_json(filled());
    const std::pair<const char*, const char*> rows[] = {
        {"/kind", R"("ab")"},
        {"/variants/0/metrics/flip/frames", "[0.25, null]"},
        {"/variants/0/chain_hash", R"("0000000000000abc")"},
        {"/variants/0/split/mse/cross", "0.1"},
        {"/variants/0/failure", "null"},
        {"/variants/1/timing", "null"},
        {"/comparison/metrics/0/bootstrap", "[-1.0, 1.0]"},
        {"/comparison/metrics/0/t_interval", "null"},
        {"/comparison/metrics/0/finding", R"("too_few_frames")"},
        {"/images/0/variant", "null"},
        {"/truth", R"("truth.####.exr")"},
        {"/input_metrics/flip/frames", "[0.5, 0.75]"},
        {"/truth_noise/sigma/mean", "0.015"},
        {"/winner", R"({"variant": 1, "metric": "flip", "words": "bad has won"})"},
        {"/warnings", R"(["a warning"])"}};
    for (const auto& [place, value] : rows)
        EXPECT_EQ(json.at(Json::json_pointer(place)), Json::parse(value)) << place;
    const Json bare = report_json(Report());
    for (const char* key : {"input_metrics", "truth_noise", "winner"})
        EXPECT_TRUE(bare.at(key).is_null()) << key;
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

TEST(ReportJson, TimingAndSplitComeBack) {
    const Report report = filled();
    const Json timing = report.variants[0].timing, split = report.variants[0].split;
    EXPECT_EQ(Json(timing.get<Timing>()), timing);
    EXPECT_EQ(Json(split.get<ErrorSplit>()), split);
    EXPECT_EQ(timing.get<Timing>().passes[0].pass, "0.fxaa");
    EXPECT_EQ(split.get<ErrorSplit>().converged_noise, 0.001);
    EXPECT_FALSE(split.get<ErrorSplit>().others.at("smape").precision);
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

// Fields of one line without quotes.
std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields;
    std::istringstream in(line + ",");
    for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
    return fields;
}

TEST(ReportCsv, EveryRowHasEveryColumn) {
    Report report = filled();
    report.variants[0].name = "one";
    report.variants[1].failure = "frame 10: no";
    const auto lines = lines_of(report_as_csv(report));
    // Header; of two variants and of the input two frames and a mean.
    ASSERT_EQ(lines.size(), 10u);
    const auto header = fields_of(lines[0]);
    for (const auto& line : lines) EXPECT_EQ(fields_of(line).size(), header.size()) << line;
    const auto field = [&](size_t line, const std::string& name) {
        const auto at = std::find(header.begin(), header.end(), name);
        EXPECT_NE(at, header.end()) << name;
        return fields_of(lines[line])[size_t(at - header.begin())];
    };
    struct Row {
        size_t line;
        const char *column, *value;
    };
    const Row rows[] = {
        {1, "variant", "one"},   {1, "frame", "10"},      {1, "flip", "0.25"},
        {2, "flip", ""},         {3, "frame", "mean"},    {3, "total_ms", "1.5"},
        {3, "mse_cross", "0.1"}, {3, "mse_total", "0.7"}, {6, "failure", "frame 10: no"},
        {3, "pareto", "no"},     {6, "pareto", "no"},     {6, "total_ms", ""},
        {7, "variant", "input"}, {7, "chain_hash", ""},   {8, "flip", "0.75"},
        {9, "frame", "mean"},    {9, "flip", "0.625"},    {9, "pareto", ""}};
    for (const auto& [line, column, value] : rows)
        EXPECT_EQ(field(line, column), value) << line << column;
    report.variants[1].pareto = true;
    EXPECT_THAT(lines_of(report_as_csv(report))[6], HasSubstr(",yes,"));
    // Quoted as in RFC 4180.
    report.variants[0].name = "one, \"two\"";
    EXPECT_THAT(report_as_csv(report), HasSubstr("\n\"one, \"\"two\"\"\","));
}

TEST(ReportMarkdown, TablesVerdictAndFailures) {
    const std::string text = report_as_markdown(filled());
    for (const char* part :
         {"Too few.", "bad failed: frame 10: no",
          "| flip | lower is better | 1 | 0.1 |  | -1 .. 1 | too few frames to decide |",
          "| flip | lower is better | 0.25 |  | 0.625 |", "| 11 | input | 0.75 |",
          "\n- **Warning:** a warning\n",
          "standard deviation 0.015 of the displayed luma; a picture without any error would have "
          "flip 0.2 |",
          "| one, two | 0.1 | 0.2 | 0.3 | 0.1 | 0.7 |", "\n- what a split has to say\n", "- a note",
          "| one, two | fxaa | rule | reason | 10 | 1 | 2 | 3 |",
          "| one, two | 1.5 | 0.5 | 3 | 0.fxaa 1.5, 1.dof left out | no: few |",
          "; clock; frame 11; without"})
        EXPECT_THAT(text, HasSubstr(part));
    EXPECT_THAT(text, Not(HasSubstr("without a measurable difference")));
    EXPECT_THAT(text, Not(HasSubstr("bad has won")));
    Report twice = filled();
    twice.variants[0].elisions.push_back(twice.variants[0].elisions[0]);
    twice.variants[0].elisions[1].first = 11;
    twice.variants[0].elisions[1].second.fact.name = "other";
    EXPECT_THAT(report_as_markdown(twice),
                HasSubstr("| rule | reason (frame 10; 1 more like it) | 10-11 | 2 | 4 | 6 |"));
    Report scored = filled();
    scored.comparison.reset();
    EXPECT_THAT(report_as_markdown(scored), HasSubstr("\nbad has won.\n"));
    Report alike = filled();
    alike.reference = "a";
    EXPECT_THAT(report_as_markdown(alike),
                ::testing::AllOf(HasSubstr("| flip | lower is more alike | 0.25 |"),
                                 Not(HasSubstr("is better |"))));
    // psnr has no value in either.
    EXPECT_THAT(text, Not(HasSubstr("| psnr |")));
    // Every row of a table has as many bars as the one before it in that table.
    std::ptrdiff_t bars = 0;
    for (const auto& line : lines_of(text)) {
        const auto here = line.starts_with('|') ? std::count(line.begin(), line.end(), '|') : 0;
        EXPECT_TRUE(bars == 0 || here == 0 || here == bars) << line;
        bars = here;
    }
}

// Rows without a finding have a table of their own, after the others.
TEST(ReportMarkdown, MetricsWithoutADifferenceStandApart) {
    Report report = filled();
    report.comparison->metrics[0].finding = Finding::b_better;
    for (const char* name : {"psnr", "ssim"}) {
        auto same = report.comparison->metrics[0];
        same.metric = name;
        same.finding = Finding::no_measurable_difference;
        report.comparison->metrics.insert(report.comparison->metrics.begin(), same);
    }
    const std::string text = report_as_markdown(report);
    const auto found = text.find("| b better |"), apart = text.find("### 2 metrics without a meas");
    const auto open = text.find("| psnr | higher is better | 1 |");
    ASSERT_TRUE(found != text.npos && apart != text.npos && open != text.npos);
    EXPECT_LT(found, apart);
    EXPECT_LT(apart, open);
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
    report.variants[1].pareto = true;
    const std::string text = report_as_markdown(report);
    EXPECT_THAT(text, HasSubstr("| variant | ms | hdr_flip | mse | psnr | Pareto set |\n"
                                "|---|---|---|---|---|---|\n"
                                "| one, two | 1.5 | 0.25 | 0.125 |  | yes |\n"
                                "| slow | 20 | 0.25 | 0.125 |  |  |\n"
                                "| input |  |  |  |  |  |\n"));
    // One that was not timed has no place in the table; of many variants each has a row of its
    // metrics.
    report.variants[1].timing.reset();
    EXPECT_THAT(report_as_markdown(report), Not(HasSubstr("| one, two | 1.5 |")));
    report.variants.resize(5, report.variants[0]);
    EXPECT_THAT(report_as_markdown(report),
                HasSubstr("| variant | flip (lower is better) |\n|---|---|\n| slow | 0.25 |\n"));
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
