// postchain blind: a page on which observers compare outputs without knowing which is which, and
// the evaluation of their choices.
//
//   NAME=OUT... --> DIR/index.html (for observers), DIR/key.json
//   --choices   --> counts, intervals and probabilities on stdout
#pragma once

#include <string>
#include <vector>

#include "tools/apps/postchain/options.h"

namespace postchain {

struct BlindOptions {
    std::vector<std::string> sides;  // "joint=out/joint.####.exr"
    std::string folder, truth;
    std::vector<std::string> choices;
    uint64_t seed = 1;
    io::OnExisting on_existing = io::OnExisting::fail;
};
void add_blind(CLI::App& subcommand, Options& options, BlindOptions& blind);
int blind_subcommand(const Options& options, const BlindOptions& blind);

}  // namespace postchain
