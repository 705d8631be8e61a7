// postchain tune: messages, progress and the file of the tuned chain.
#pragma once

#include <string>
#include <vector>

#include "tools/apps/postchain/options.h"
#include "tools/measure/tune/tune.h"

namespace postchain {

struct TuneOptions {
    std::vector<std::string> chains;  // to start from; empty: shipped ones
    tune::TuneSettings settings;
};

void add_tune(CLI::App& subcommand, Options& options, TuneOptions& tune);
int tune_subcommand(const Options& options, const TuneOptions& tune, int argc, char** argv);

}  // namespace postchain
