// The subcommands of postchain-lab. Each add_NAME() is one for Subcommand::add.
#pragma once

#include "tools/apps/common/program.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain {

RunSubcommand add_ab(CLI::App& subcommand, Options& options);     // experiments.cpp
RunSubcommand add_bench(CLI::App& subcommand, Options& options);  // experiments.cpp
RunSubcommand add_scene(CLI::App& subcommand, Options& options);
RunSubcommand add_stress(CLI::App& subcommand, Options& options);
RunSubcommand add_study(CLI::App& subcommand, Options& options);
RunSubcommand add_tune(CLI::App& subcommand, Options& options);

std::vector<std::string> scene_names();  // scene.cpp

// The progress of ab, bench, study and tune: updates one line on a terminal; otherwise prints a
// line per unit of work. `json`: also a line on stdout, at most once a second, and of the first and
// the last unit.
experiment::ProgressCallback progress_printer(bool json);  // experiments.cpp

// How an ab, bench or study ended that wrote its results.
struct MeasurementEnd {
    int exit_code = kExitOk;
    std::string verdict;               // on one line
    std::vector<std::string> reasons;  // of an exit code that is not 0
    bool failed = false;               // every chain missed frames
    bool interrupted = false;
};
MeasurementEnd interrupted(const StopOnSignal& stop, const std::string& how_to_go_on);
// The exit code. `json`: also the last line on stdout, unless it was interrupted.
Result<int> end_of(const Result<MeasurementEnd>& end, bool json);  // experiments.cpp
inline constexpr const char* kJsonHelp = "progress and outcome as lines of JSON on stdout";

}  // namespace postchain
