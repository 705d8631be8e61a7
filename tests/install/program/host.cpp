// Motion blur in C++, with the installed library. The library's own context replaces the engine's.
#include <cstdio>
#include <postchain/postchain.hpp>

#include "frame.h"

int main() {
    auto info = pc::create_info();
    info.flags = PC_OWN_CONTEXT;
    const auto instance = pc::create(info);
    const auto chain = pc::chain("motion_blur");
    if (!instance || !chain) {
        std::fprintf(stderr, "%s\n", pc_error());
        return 1;
    }
    auto frame = pc::make<pc_frame>();
    make_frame(&frame);
    pc_texture result;
    if (pc_prepare(instance.get(), chain.get(), &frame, 1) != PC_OK ||
        pc_run(instance.get(), chain.get(), &frame, &result) != PC_OK) {
        std::fprintf(stderr, "%s\n", pc_last_error(instance.get()));
        return 1;
    }
    const bool blurred = is_blurred(&result);
    std::printf("%s, %zu parameters\n", blurred ? "blurred" : "not blurred",
                pc::parameters(chain.get()).size());
    return blurred ? 0 : 1;
}
