// A program of subcommands: the command itself, and the programs of its parts (postchain-lab,
// postchain-serve, postchain-view), which it starts for their subcommands.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/apps/common/options.h"

namespace postchain {

// A program that may be missing. It is installed in the folder of the command.
struct Part {
    const char* program;    // also the name of its Debian package
    const char* component;  // of cmake --install
};
inline constexpr Part kLab = {"postchain-lab", "lab"};
inline constexpr Part kServe = {"postchain-serve", "serve"};
inline constexpr Part kView = {"postchain-view", "view"};

// The subcommands of all programs, as --help lists them.
struct SubcommandRow {
    const char* group;  // heading
    const char* name;
    const char* help;
    const Part* part = nullptr;  // none: the command has it
};
inline constexpr const char* kReference = "Reference";
std::span<const SubcommandRow> all_subcommands();

// Runs a subcommand with the options that were parsed. Returns the exit code; a failure's is that
// of fail(), which prints it.
using RunSubcommand = std::function<Result<int>()>;

// A subcommand that this program has.
struct Subcommand {
    const char* name;
    // Adds the options to `subcommand` and returns the function that runs it; both arguments must
    // outlive that function.
    RunSubcommand (*add)(CLI::App& subcommand, Options& options);
    std::vector<std::string> (*first_words)() = nullptr;  // known values of the first argument
};

struct Program {
    const char* name;
    const char* description;
    const Part* part;  // null: the command
    std::span<const Subcommand> subcommands;
    const char* only = nullptr;  // stands in front of words that name no subcommand

    const Subcommand* find(std::string_view subcommand) const;
};

// main() of `program`. Returns the exit code.
int run_program(const Program& program, int argc, char** argv);

}  // namespace postchain
