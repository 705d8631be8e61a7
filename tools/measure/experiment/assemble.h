// What stands around an experiment, whoever starts it: settings that its tables do not say, the
// truth of a generated scene, and the files of the report.
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

struct Surroundings {
    sequence::RunSettings run;
    std::string input;                     // as typed
    std::vector<std::string> chain_files;  // as typed
    std::vector<Camera> cameras;           // of the chains, which may name pictures
    std::vector<std::string> command;
    int threads = 0;  // CPU threads; 0 = one per core
};
void complete(ExperimentSettings& settings, Surroundings around);

// Without settings.truth: that of the generated scene, where the input is one; else the reason in
// settings.no_truth. Makes a GL context of its own and leaves none current where it renders.
// `progress`: "truth of still, frame 3, 40 %"; false stops. `files`: of prepare_folder(). Errors:
// those of survey_input() and generate_truth().
Status find_truth(BenchSettings& settings, const io::OutputFiles& files,
                  const egl::ContextOptions& context,
                  const std::function<bool(const std::string&)>& progress);

// report.json, report.csv, report.md and index.html of the report's folder. `assets`: as
// ExperimentSettings. Errors (output).
Status write_report_files(const report::Report& report, const std::string& assets);
std::string page_path(const report::Report& report);

// How an experiment ends whose report is written: sequence::kExitOk, kExitSomeFailed where a
// variant failed, kExitThreshold where a mean exceeds its limit, each line in `broken`, or where
// not all of a bench's limits are `met`.
int exit_code_of(const report::Report& report, const std::vector<report::MetricLimit>& limits,
                 bool met, std::vector<std::string>& broken);

// "flip=0.05" of the option's texts. Errors (usage): those of parse_limit().
Result<std::vector<report::MetricLimit>> limits_of(const std::string& option,
                                                   const std::vector<std::string>& texts,
                                                   report::Kind kind, bool with_truth);

}  // namespace postchain::experiment
