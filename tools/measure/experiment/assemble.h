// Common parts of ab and bench: the ground truth of a generated scene, and the report's files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/report/limits.h"
#include "tools/measure/report/report.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::experiment {

// If settings.truth is empty, renders the ground truth of the generated scene that the input
// belongs to, otherwise stores the reason in settings.no_truth. Rendering makes a GL context and
// leaves none current. `progress`: "truth of still, frame 3, 40 %"; false stops. `files`: from
// prepare_folder(). Errors: those of survey_input() and generate_truth().
Status find_truth(BenchSettings& settings, const io::OutputFiles& files,
                  const egl::ContextOptions& context,
                  const std::function<bool(const std::string&)>& progress);

// Writes report.json, report.csv, report.md and index.html into the report's folder. `assets`: as
// in ExperimentSettings. Errors (output).
Status write_report_files(const report::Report& report, const std::string& assets);
std::string page_path(const report::Report& report);

// Exit code of an experiment whose report is written: kExitSomeFailed if a variant failed;
// kExitThreshold if a mean exceeds its limit (each adds a line to `broken`) or not all of a bench's
// limits are `met`; otherwise kExitOk.
int exit_code_of(const report::Report& report, const std::vector<report::MetricLimit>& limits,
                 bool met, std::vector<std::string>& broken);

// Parses "flip=0.05" options. Errors (usage): those of parse_limit().
Result<std::vector<report::MetricLimit>> limits_of(const std::string& option,
                                                   const std::vector<std::string>& texts,
                                                   report::Kind kind, bool with_truth);

}  // namespace postchain::experiment
