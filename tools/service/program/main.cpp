// postchain-serve: the service, and the helpers that it starts from its own file.
#include <string_view>

#include "passes/registry.h"
#include "tools/service/program/serve.h"
#include "tools/service/work/image_helper.h"
#include "tools/service/work/preview_helper.h"

int main(int argc, char** argv) {
    using namespace postchain;
    const std::string_view word = argc == 2 ? argv[1] : "";
    if (word == service::kImageHelper) return service::run_image_helper(builtin_passes());
    if (word == service::kPreviewHelper) return service::run_preview_helper(builtin_passes());
    if (word == service::kProgramHelper) return service::run_program_helper(builtin_passes());
    const Subcommand subcommands[] = {{"serve", add_serve}};
    return run_program(
        {"postchain-serve", "Accepts jobs of postchain over HTTP.", &kServe, subcommands, "serve"},
        argc, argv);
}
