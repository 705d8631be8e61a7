// postchain-serve: the service.
#include "tools/service/program/serve.h"

int main(int argc, char** argv) {
    using namespace postchain;
    const Subcommand subcommands[] = {{"serve", add_serve}};
    return run_program(
        {"postchain-serve", "Accepts jobs of postchain over HTTP.", &kServe, subcommands, "serve"},
        argc, argv);
}
