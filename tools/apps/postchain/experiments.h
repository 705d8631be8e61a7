// postchain ab and bench: run experiments with messages, progress and signals.
#pragma once

#include "tools/apps/postchain/options.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/settings.h"

namespace postchain {

struct ExperimentOptions {
    experiment::ExperimentSettings ab;
    experiment::BenchSettings bench;
    std::string chain_b;  // of ab; A is Options::chain
    std::vector<std::string> fail_above;
    std::vector<std::string> sweeps;  // of bench
    std::vector<std::string> under;   // of bench
};
// Updates one line on a terminal; otherwise prints a line per unit of work.
experiment::ProgressCallback progress_printer();

void add_ab(CLI::App& subcommand, Options& options, ExperimentOptions& experiment);
int ab_subcommand(const Options& options, const ExperimentOptions& experiment, int argc,
                  char** argv);
void add_bench(CLI::App& subcommand, Options& options, ExperimentOptions& experiment);
int bench_subcommand(const Options& options, const ExperimentOptions& experiment, int argc,
                     char** argv);

}  // namespace postchain
