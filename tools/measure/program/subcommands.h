// The subcommands of postchain-lab. Each add_NAME() is one for Subcommand::add.
#pragma once

#include "tools/apps/common/program.h"
#include "tools/measure/experiment/experiment.h"

namespace postchain {

RunSubcommand add_ab(CLI::App& subcommand, Options& options);     // experiments.cpp
RunSubcommand add_bench(CLI::App& subcommand, Options& options);  // experiments.cpp
RunSubcommand add_scene(CLI::App& subcommand, Options& options);
RunSubcommand add_stress(CLI::App& subcommand, Options& options);
RunSubcommand add_study(CLI::App& subcommand, Options& options);
RunSubcommand add_tune(CLI::App& subcommand, Options& options);

std::vector<std::string> scene_names();  // scene.cpp

// The progress of ab, bench, study and tune: updates one line on a terminal; otherwise prints a
// line per unit of work.
experiment::ProgressCallback progress_printer();  // experiments.cpp

}  // namespace postchain
