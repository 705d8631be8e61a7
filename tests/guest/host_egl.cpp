// The host's context: EGL without a window.
#include <cstdio>
#include <cstdlib>

#include "chain/egl/context.h"
#include "tests/guest/host.h"

namespace postchain::test {
namespace {

std::unique_ptr<egl::Context>& host_context() {
    static std::unique_ptr<egl::Context> context;
    return context;
}
std::unique_ptr<egl::Context> other;

std::unique_ptr<egl::Context> make() {
    auto made = egl::Context::create();
    if (!made.ok()) {
        std::fprintf(stderr, "%s\n", made.status().message().c_str());
        std::exit(1);
    }
    return std::move(*made);
}

}  // namespace

void make_host_context() {
    if (!host_context()) host_context() = make();
}
void release_host_context() {
    host_context()->release_current();
}
void regain_host_context() {
    (void)host_context()->make_current();
}
void other_context() {
    other = make();
}
void other_context_done() {
    other.reset();
    regain_host_context();
}

}  // namespace postchain::test
