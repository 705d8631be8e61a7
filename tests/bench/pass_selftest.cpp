// The rows of `postchain selftest` for each pass, in a build of the core, which reads neither files
// nor chain files: each pass with its defaults over the reduced stability matrix (fp32), against
// its double-precision reference; the same bits when repeated and with nothing left out.
#include <cstdio>

#include "chain/egl/context.h"
#include "passes/registry.h"
#include "tools/stress/matrix.h"

int main() {
    using namespace postchain;
    const auto context = egl::Context::create();
    if (!context.ok()) {
        std::fprintf(stderr, "%s\n", context.status().message().c_str());
        return 6;
    }
    stress::print_heads();
    bool failed = false;
    for (const auto& type : builtin_passes().types()) {
        Chain chain;
        chain.append(builtin_passes(), type.name);
        Executor executor((*context)->device());
        const auto row = stress::test_subject(executor, {type.name, std::move(chain)});
        stress::print_row(row);
        std::fflush(stdout);
        failed |= !row.faults.empty();
    }
    return failed ? 1 : 0;
}
