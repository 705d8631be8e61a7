// The report of a study: plain data made from the results of its tasks, and its files.
//
//   results --make_report()--> StudyReport --> report.json, report.csv, report.md, index.html
//
// It has no times but the ratios of questions that say equal time; times are in the reports of the
// scenes. So its bytes depend on the results only, not on how the work was split.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/study/study_folder.h"
#include "tools/measure/study/table.h"
#include "tools/sequence/files/json.h"

namespace postchain::study {

struct SceneEntry {
    std::string name, family, input, truth;
    std::vector<int> frames;
    int width = 0, height = 0;         // pixels
    std::vector<std::string> reports;  // index.html of each call of ab or bench, relative
    std::string failure;               // if not empty, the scene is in no table
};

struct StudyReport {
    std::string title, version;
    report::Kind kind = report::Kind::ab;
    std::vector<std::string> variants, chain_texts;
    std::vector<std::string> revisions;  // commits by which scenes were measured
    std::vector<std::pair<size_t, size_t>> pairs;
    std::vector<Equal> equal;                        // by pair
    std::vector<std::optional<double>> time_ratios;  // B / A, of pairs that say equal time
    std::vector<SceneEntry> scenes;
    std::vector<MetricTable> tables;
    std::vector<std::string> notes;

    std::string pair_name(size_t pair) const;  // "joint against lens"
    // "equal samples", "equal time: 1.04" (B / A) or ""
    std::string condition(size_t pair) const;
    const MetricTable* table(const std::string& metric) const;
    // A sentence for each pair, by HDR-FLIP.
    std::vector<std::string> verdict() const;
    size_t failures() const;
};

// `results` of all tasks, in the order of tasks_of(). A scene is in the tables if all its tasks
// are.
StudyReport make_report(const Study& study, const std::vector<TaskResult>& results);
// Errors: those of StudyFolder::result(); (input): a result is missing.
Result<StudyReport> read_report(const Study& study, const StudyFolder& folder);

io::Json report_json(const StudyReport& report);
std::string report_as_csv(const StudyReport& report);
std::string report_as_markdown(const StudyReport& report);

// All four files. Errors (output).
Status write_report(const StudyReport& report, const StudyFolder& folder);

}  // namespace postchain::study
