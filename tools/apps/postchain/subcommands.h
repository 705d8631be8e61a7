// The subcommands. Each add_NAME() adds the options of one to `subcommand` and returns the function
// that runs it; both arguments must outlive that function.
#pragma once

#include <functional>

#include "tools/apps/postchain/options.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/stress/matrix.h"

namespace postchain {

// Runs a subcommand with the options that were parsed. Returns the exit code; a failure's is that
// of fail(), which prints it.
using RunSubcommand = std::function<Result<int>()>;

RunSubcommand add_ab(CLI::App& subcommand, Options& options);     // experiments.cpp
RunSubcommand add_bench(CLI::App& subcommand, Options& options);  // experiments.cpp
RunSubcommand add_blind(CLI::App& subcommand, Options& options);
RunSubcommand add_check(CLI::App& subcommand, Options& options);
RunSubcommand add_completion(CLI::App& subcommand, Options& options);
RunSubcommand add_diff(CLI::App& subcommand, Options& options);
RunSubcommand add_info(CLI::App& subcommand, Options& options);  // describe.cpp
RunSubcommand add_inspect(CLI::App& subcommand, Options& options);
RunSubcommand add_man(CLI::App& subcommand, Options& options);     // completion.cpp
RunSubcommand add_passes(CLI::App& subcommand, Options& options);  // describe.cpp
RunSubcommand add_plan(CLI::App& subcommand, Options& options);
RunSubcommand add_run(CLI::App& subcommand, Options& options);
RunSubcommand add_scene(CLI::App& subcommand, Options& options);
RunSubcommand add_schema(CLI::App& subcommand, Options& options);  // describe.cpp
RunSubcommand add_selftest(CLI::App& subcommand, Options& options);
RunSubcommand add_serve(CLI::App& subcommand, Options& options);
RunSubcommand add_sheet(CLI::App& subcommand, Options& options);
RunSubcommand add_stress(CLI::App& subcommand, Options& options);
RunSubcommand add_study(CLI::App& subcommand, Options& options);
RunSubcommand add_tune(CLI::App& subcommand, Options& options);
RunSubcommand add_view(CLI::App& subcommand, Options& options);

// The progress of ab, bench, study and tune: updates one line on a terminal; otherwise prints a
// line per unit of work.
experiment::ProgressCallback progress_printer();  // experiments.cpp

// Each pass of the registry by itself, and shipped chains of both orders.
Result<std::vector<stress::Subject>> every_subject();  // stress.cpp

}  // namespace postchain
