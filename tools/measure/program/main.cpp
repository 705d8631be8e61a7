// postchain-lab: the subcommands that measure chains.
#include "tools/measure/program/subcommands.h"

int main(int argc, char** argv) {
    using namespace postchain;
    const Subcommand subcommands[] = {
        {"tune", add_tune},
        {"ab", add_ab},
        {"bench", add_bench},
        {"study", add_study},
        {"scene", add_scene, scene_names},
        {"stress", add_stress},
    };
    return run_program({"postchain-lab",
                        "The instruments of postchain: error against run time, comparisons, "
                        "generated scenes, extreme cases.",
                        &kLab, subcommands},
                       argc, argv);
}
