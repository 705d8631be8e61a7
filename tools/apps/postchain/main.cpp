// postchain: the command. Each of its subcommands has its own file; those of parts are in the
// programs that it starts.
#include "config/chain_find.h"
#include "tools/apps/postchain/subcommands.h"

int main(int argc, char** argv) {
    using namespace postchain;
    const Subcommand subcommands[] = {
        {"run", add_run, shipped_chains},
        {"plan", add_plan, shipped_chains},
        {"inspect", add_inspect},
        {"check", add_check},
        {"sheet", add_sheet},
        {"diff", add_diff},
        {"selftest", add_selftest},
        {"info", add_info},
        {"passes", add_passes},
        {"schema", add_schema},
    };
    return run_program(
        {"postchain", "Motion blur, FXAA and depth of field over rendered frames, in any order.",
         nullptr, subcommands},
        argc, argv);
}
