// The man page and the bash completion of a program, from its options and the parameter tables.
#pragma once

#include <string>

#include "tools/apps/common/program.h"

namespace postchain {

// roff.
std::string man_page(const Program& program, const CLI::App& app);
// A script that completes the command and its parts.
std::string bash_completion(const Program& program, const CLI::App& app);

// Every program has these subcommands.
struct Manual {
    const char *name, *help;
    std::string (*text_of)(const Program& program, const CLI::App& app);
};
inline constexpr Manual kManuals[] = {
    {"man", "the man page, as roff", man_page},
    {"completion", "completion script for bash", bash_completion},
};

}  // namespace postchain
