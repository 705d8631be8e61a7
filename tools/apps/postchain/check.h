// postchain check: which outputs of sequences are whole, missing, or from other settings.
#pragma once

#include <string>
#include <vector>

#include "tools/apps/postchain/options.h"

namespace postchain {

struct CheckOptions {
    std::vector<std::string> outputs;
    std::string frames;
    std::string like;
};
void add_check(CLI::App& subcommand, Options& options, CheckOptions& check);
// Exit code 0 if every frame is whole, 1 if not.
int check_subcommand(const Options& options, const CheckOptions& check);

}  // namespace postchain
