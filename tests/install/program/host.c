/* Motion blur in C, with the installed library. The library's own context replaces the engine's. */
#include <postchain/postchain.h>
#include <stdio.h>

#include "frame.h"

int main(void) {
    pc_create_info info = {.struct_size = sizeof(info), .api_version = PC_API_VERSION};
    info.flags = PC_OWN_CONTEXT;
    pc_instance* instance = NULL;
    pc_chain* chain = NULL;
    if (pc_create(&info, &instance) != PC_OK || pc_chain_create("motion_blur", &chain) != PC_OK) {
        fprintf(stderr, "%s\n", pc_error());
        return 1;
    }
    pc_frame frame = {.struct_size = sizeof(frame)};
    make_frame(&frame);
    pc_texture result;
    if (pc_prepare(instance, chain, &frame, 1) != PC_OK ||
        pc_run(instance, chain, &frame, &result) != PC_OK) {
        fprintf(stderr, "%s\n", pc_last_error(instance));
        return 1;
    }
    const int blurred = is_blurred(&result);
    pc_chain_destroy(chain);
    pc_destroy(instance);
    printf("%s\n", blurred ? "blurred" : "not blurred");
    return blurred ? 0 : 1;
}
