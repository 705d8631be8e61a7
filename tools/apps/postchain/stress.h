// postchain stress: the stability matrix of a chain, or of every pass and both orders.
//
//   CHAIN, or each pass of the registry separately + shipped chains of both orders
//     --tools/stress--> Matrix --> text or JSON on stdout
//     -o DIR            --> DIR/stress.txt, DIR/stress.json, DIR/index.html
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

struct StressOptions {
    std::string only;
    std::string folder;  // empty = writes no files
    io::OnExisting on_existing = io::OnExisting::fail;
};
void add_stress(CLI::App& subcommand, Options& options, StressOptions& stress);
int stress_subcommand(const Options& options, const StressOptions& stress);

}  // namespace postchain
