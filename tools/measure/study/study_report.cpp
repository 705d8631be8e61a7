#include "tools/measure/study/study_report.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "config/markdown.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/report_text.h"
#include "tools/measure/report/words.h"
#include "tools/page/page.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::study {
namespace {

using io::Json;

constexpr const char* kVerdictMetric = "hdr_flip";
constexpr double kEqualTime = 1.25;  // ratio of times up to which they are called equal

std::string number(const std::optional<double>& value) {
    return value ? report::figure(*value) : "";
}

Json json_of(const std::vector<Row>& rows, bool families) {
    Json list = Json::array();
    for (const Row& row : rows) {
        Json json = {{"name", row.name}};
        if (families)
            json["scenes"] = row.scenes;
        else
            json["family"] = row.family;
        json["means"] = row.means;
        json["gains"] = row.gains;
        list.push_back(std::move(json));
    }
    return list;
}

const char* word_of(Decision decision) {
    constexpr const char* kWords[] = {"too_few_families", "not_decided", "equal", "a_nearer",
                                      "b_nearer"};
    return kWords[size_t(decision)];
}

Json alone(const std::optional<Probability>& one) {
    return one ? Json(one->alone) : Json();
}
Json corrected(const std::optional<Probability>& one) {
    return one ? Json(one->corrected) : Json();
}

// RFC 4180; a spreadsheet does not read it as a formula.
std::string field(const std::string& text) {
    std::string out = "\"";
    if (!text.empty() && std::string("=+-@\t\r").find(text[0]) != std::string::npos) out += '\'';
    for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + "\"";
}

// Time of B over that of A, of a question that says equal time.
std::optional<double> time_ratio(const Study& study, const Task& task, const TaskResult& result,
                                 size_t pair) {
    if (study.equal[pair] != Equal::time || (task.pair && *task.pair != pair)) return std::nullopt;
    const auto& [a, b] = study.pairs[pair];
    const auto& of_a = result.variants[task.pair ? 0 : a].time_ms;
    const auto& of_b = result.variants[task.pair ? 1 : b].time_ms;
    if (!of_a || !of_b || *of_a <= 0 || *of_b <= 0) return std::nullopt;
    return *of_b / *of_a;
}

void add_figures(const Study& study, const Task& task, const TaskResult& result,
                 SceneFigures& figures) {
    if (!task.pair) {
        for (size_t v = 0; v < result.variants.size(); ++v)
            figures.variants[v] = result.variants[v].metrics;
        for (size_t p = 0; p < study.pairs.size(); ++p)
            figures.pairs[p] = {result.variants[study.pairs[p].first].metrics,
                                result.variants[study.pairs[p].second].metrics};
        return;
    }
    const auto& [a, b] = study.pairs[*task.pair];
    figures.variants.try_emplace(a, result.variants[0].metrics);
    figures.variants.try_emplace(b, result.variants[1].metrics);
    figures.pairs[*task.pair] = {result.variants[0].metrics, result.variants[1].metrics};
}

}  // namespace

std::string StudyReport::pair_name(size_t pair) const {
    return variants[pairs[pair].second] + " against " + variants[pairs[pair].first];
}

std::string StudyReport::condition(size_t pair) const {
    if (equal[pair] == Equal::samples) return "equal samples";
    if (equal[pair] != Equal::time) return "";
    if (!time_ratios[pair]) return "equal time, not measured";
    const double ratio = *time_ratios[pair];
    return concat(std::max(ratio, 1 / ratio) > kEqualTime ? "not equal time: " : "equal time: ",
                  report::figure(ratio));
}

const MetricTable* StudyReport::table(const std::string& metric) const {
    for (const auto& table : tables)
        if (table.metric.name == metric) return &table;
    return nullptr;
}

std::vector<std::string> StudyReport::verdict() const {
    const MetricTable* found = table(kVerdictMetric);
    if (!found) return {"no scene could be measured"};
    std::vector<std::string> lines;
    for (size_t p = 0; p < pairs.size(); ++p)
        lines.push_back(concat(pair_name(p), condition(p).empty() ? "" : " (" + condition(p) + ")",
                               ", HDR-FLIP: ", found->pairs[p].words));
    return lines;
}

size_t StudyReport::failures() const {
    return size_t(
        std::ranges::count_if(scenes, [](const auto& scene) { return !scene.failure.empty(); }));
}

StudyReport make_report(const Study& study, const std::vector<TaskResult>& results) {
    StudyReport report;
    report.title = study.title;
    report.kind = study.kind;
    report.variants = study.names();
    report.pairs = study.pairs;
    report.equal = study.equal;
    for (size_t v = 0; v < report.variants.size(); ++v)
        report.chain_texts.push_back(write_chain(study.chains[v].chain));
    std::vector<SceneFigures> figures(study.scenes.size());
    for (size_t s = 0; s < study.scenes.size(); ++s) {
        const Scene& scene = study.scenes[s];
        report.version = scene.measured.run.version;
        figures[s].scene = scene.name;
        figures[s].family = scene.family;
        SceneEntry entry;
        entry.name = scene.name;
        entry.family = scene.family;
        entry.input = scene.input;
        report.scenes.push_back(std::move(entry));
    }
    const auto tasks = tasks_of(study);
    std::set<std::string> renderers, revisions;
    std::vector<std::vector<double>> time_logs(study.pairs.size());  // log(B / A) for each scene
    for (size_t u = 0; u < tasks.size(); ++u) {
        const TaskResult& result = results[u];
        SceneEntry& entry = report.scenes[tasks[u].scene];
        if (!result.failure.empty()) {
            if (entry.failure.find(result.failure) == std::string::npos)
                entry.failure += (entry.failure.empty() ? "" : "; ") + result.failure;
            continue;
        }
        renderers.insert(result.renderer);
        revisions.insert(result.revision);
        for (size_t p = 0; p < study.pairs.size(); ++p)
            if (const auto ratio = time_ratio(study, tasks[u], result, p))
                time_logs[p].push_back(std::log(*ratio));
        entry.truth = result.truth;
        entry.frames = result.frames;
        entry.width = result.width;
        entry.height = result.height;
        entry.reports.push_back(report_folder_of(study, tasks[u]) + "/index.html");
        add_figures(study, tasks[u], result, figures[tasks[u].scene]);
    }
    std::vector<SceneFigures> whole;
    for (size_t s = 0; s < figures.size(); ++s)
        if (report.scenes[s].failure.empty()) whole.push_back(std::move(figures[s]));
    report.tables = tables_of(experiment::metric_columns(study.kind, true), report.variants,
                              report.pairs, whole, study.margins);
    report.revisions.assign(revisions.begin(), revisions.end());
    for (const auto& logs : time_logs)
        report.time_ratios.push_back(
            logs.empty() ? std::nullopt
                         : std::optional(std::exp(std::accumulate(logs.begin(), logs.end(), 0.0) /
                                                  double(logs.size()))));
    for (const auto& renderer : renderers) report.notes.push_back("Measured on " + renderer + ".");
    if (renderers.size() > 1)
        report.notes.push_back(
            "Scenes were measured on different devices, whose rounding may differ.");
    report.notes.push_back(
        "A gain is how much closer the second is to ground truth than the first, frame by frame of "
        "one scene; then means over the frames of a scene, the scenes of a family, and families. "
        "Intervals are 95 %, over families.");
    report.notes.push_back(
        "A result is decided, or equal within its margin, if the probability of a t test over "
        "families, corrected by Holm for the questions of this study, is below 5 %. Intervals are "
        "not corrected. Each metric is tested alone; the verdict is by HDR-FLIP.");
    if (revisions.size() > 1)
        report.notes.push_back("Scenes were measured by different commits of the program.");
    return report;
}

Result<StudyReport> read_report(const Study& study, const StudyFolder& folder) {
    std::vector<TaskResult> results;
    for (const Task& task : tasks_of(study)) {
        ASSIGN_OR_RETURN(auto result, folder.result(study, task));
        if (!result)
            return Status(StatusCode::input, concat(folder.path(), "/", result_path(task),
                                                    ": is not there; the study is not complete"));
        results.push_back(std::move(*result));
    }
    return make_report(study, results);
}

io::Json report_json(const StudyReport& report) {
    Json variants = Json::array();
    for (size_t v = 0; v < report.variants.size(); ++v)
        variants.push_back({{"name", report.variants[v]}, {"chain", report.chain_texts[v]}});
    Json pairs = Json::array();
    for (size_t p = 0; p < report.pairs.size(); ++p)
        pairs.push_back({{"a", report.variants[report.pairs[p].first]},
                         {"b", report.variants[report.pairs[p].second]},
                         {"equal", name_of(report.equal[p])},
                         {"time_ratio", report.time_ratios[p]}});
    Json scenes = Json::array();
    for (const auto& scene : report.scenes)
        scenes.push_back({{"name", scene.name},
                          {"family", scene.family},
                          {"input", scene.input},
                          {"truth", scene.truth},
                          {"frames", scene.frames},
                          {"width", scene.width},
                          {"height", scene.height},
                          {"reports", scene.reports},
                          {"failure", scene.failure.empty() ? Json() : Json(scene.failure)}});
    Json tables = Json::array();
    for (const auto& table : report.tables) {
        Json results = Json::array();
        for (size_t p = 0; p < table.pairs.size(); ++p) {
            const PairResult& one = table.pairs[p];
            results.push_back({{"a", report.variants[report.pairs[p].first]},
                               {"b", report.variants[report.pairs[p].second]},
                               {"gain", one.mean},
                               {"interval", one.interval},
                               {"probability", alone(one.difference)},
                               {"probability_holm", corrected(one.difference)},
                               {"margin", one.margin},
                               {"probability_beyond_margin", alone(one.equivalence)},
                               {"probability_beyond_margin_holm", corrected(one.equivalence)},
                               {"families", one.families},
                               {"families_nearer", one.nearer},
                               {"families_farther", one.farther},
                               {"sign_probability", one.sign_probability},
                               {"scenes", one.scenes},
                               {"scenes_nearer", one.scenes_nearer},
                               {"finding", word_of(one.decision)},
                               {"words", one.words}});
        }
        tables.push_back({{"metric", table.metric.name},
                          {"help", table.metric.help},
                          {"better", report::name_of(table.metric.better)},
                          {"scenes", json_of(table.scenes, false)},
                          {"families", json_of(table.families, true)},
                          {"means", table.means},
                          {"best", table.best ? Json(report.variants[*table.best]) : Json()},
                          {"pairs", results}});
    }
    return {{"postchain_study_report", 1},
            {"kind", report::name_of(report.kind)},
            {"title", report.title},
            {"version", report.version},
            {"revisions", report.revisions},
            {"verdict", report.verdict()},
            {"variants", variants},
            {"pairs", pairs},
            {"scenes", scenes},
            {"tables", tables},
            {"notes", report.notes}};
}

std::string report_as_csv(const StudyReport& report) {
    std::string text = "metric,row,name,family";
    for (const auto& name : report.variants) text += "," + field(name);
    for (size_t p = 0; p < report.pairs.size(); ++p)
        text += "," + field("gain of " + report.pair_name(p));
    text += "\n";
    const auto full = [](const std::optional<double>& value) {
        return value ? io::json_text(*value) : std::string();
    };
    for (const auto& table : report.tables) {
        const auto add = [&](const char* what, const Row& row) {
            text +=
                concat(table.metric.name, ",", what, ",", field(row.name), ",", field(row.family));
            for (const auto& value : row.means) text += "," + full(value);
            for (const auto& value : row.gains) text += "," + full(value);
            text += "\n";
        };
        for (const Row& row : table.scenes) add("scene", row);
        for (const Row& row : table.families) add("family", row);
        Row mean{"", "", 0, table.means, {}}, low = mean, high = mean;
        low.means.assign(table.means.size(), std::nullopt);
        high.means = low.means;
        for (const PairResult& one : table.pairs) {
            mean.gains.push_back(one.mean);
            low.gains.push_back(one.interval ? std::optional(one.interval->low) : std::nullopt);
            high.gains.push_back(one.interval ? std::optional(one.interval->high) : std::nullopt);
        }
        add("mean", mean);
        add("low", low);
        add("high", high);
    }
    return text;
}

std::string report_as_markdown(const StudyReport& report) {
    std::string text = "# " + markdown_cell(report.title) + "\n\n";
    for (const auto& line : report.verdict()) text += "- " + markdown_cell(line) + "\n";
    text += concat(
        "- postchain ", report.version, ", commit", report.revisions.size() > 1 ? "s" : "",
        [&] {
            std::string all;
            for (const auto& one : report.revisions) all += " " + one;
            return all;
        }(),
        "\n");
    for (const auto& scene : report.scenes)
        if (!scene.failure.empty())
            text += "- " + markdown_cell("failed: " + scene.name + ": " + scene.failure) + "\n";
    text += "\n## Scenes\n\n" +
            report::markdown_header({"scene", "family", "input", "truth", "frames", "size"});
    for (const auto& scene : report.scenes)
        text += report::markdown_row({scene.name, scene.family, scene.input, scene.truth,
                                      sequence::frames_text(scene.frames),
                                      concat(scene.width, "x", scene.height)});
    text += "\n## Gains, mean over families\n\n" +
            report::markdown_header({"question", "condition", "metric", "gain", "95 %", "p, Holm",
                                     "families", "result"});
    for (size_t p = 0; p < report.pairs.size(); ++p)
        for (const auto& table : report.tables) {
            const PairResult& one = table.pairs[p];
            if (!one.mean) continue;
            text += report::markdown_row(
                {report.pair_name(p), report.condition(p), table.metric.name, number(one.mean),
                 one.interval ? concat(report::figure(one.interval->low), " to ",
                                       report::figure(one.interval->high))
                              : "",
                 one.difference ? report::figure(one.difference->corrected) : "",
                 concat(one.nearer, " of ", one.families), one.words});
        }
    for (const auto& table : report.tables) {
        text += concat("\n## ", table.metric.name, "\n\n", markdown_cell(table.metric.help), "; ",
                       report::words_of(table.metric.better, "truth"), "\n\n");
        std::vector<std::string> head = {"scene", "family"};
        head.insert(head.end(), report.variants.begin(), report.variants.end());
        for (size_t p = 0; p < report.pairs.size(); ++p)
            head.push_back("gain of " + report.pair_name(p));
        text += report::markdown_header(head);
        const auto add = [&](const std::string& name, const std::string& family, const Row& row) {
            std::vector<std::string> cells = {name, family};
            for (const auto& value : row.means) cells.push_back(number(value));
            for (const auto& value : row.gains) cells.push_back(number(value));
            text += report::markdown_row(cells);
        };
        for (const Row& row : table.scenes) add(row.name, row.family, row);
        for (const Row& row : table.families)
            add("mean of " + report::counted(row.scenes, "scene"), row.name, row);
        Row mean{"", "", 0, table.means, {}};
        for (const PairResult& one : table.pairs) mean.gains.push_back(one.mean);
        add("mean over families", "", mean);
    }
    text += "\n## Chains\n";
    for (size_t v = 0; v < report.variants.size(); ++v)
        text +=
            concat("\n`", report.variants[v], "`:\n\n```yaml\n", report.chain_texts[v], "```\n");
    text += "\n## Notes\n\n";
    for (const auto& note : report.notes) text += "- " + markdown_cell(note) + "\n";
    return text;
}

Status write_report(const StudyReport& report, const StudyFolder& folder) {
    const Json json = report_json(report);
    RETURN_IF_ERROR(folder.write("report.json", io::json_text(json, 1) + "\n"));
    RETURN_IF_ERROR(folder.write("report.csv", report_as_csv(report)));
    RETURN_IF_ERROR(folder.write("report.md", as_keys(report_as_markdown(report))));
    return folder.write("index.html", page::with_data("study/page.html", io::json_text(json)));
}

}  // namespace postchain::study
