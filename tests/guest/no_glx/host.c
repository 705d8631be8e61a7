/* A host whose GLX library has no glXGetCurrentContext(), as under a tracer of EGL alone: libepoxy
 * would end the process at its first GL call. */
#include <postchain/postchain.h>
#include <stdio.h>
#include <string.h>

int main(void) {
    pc_create_info info = {.struct_size = sizeof(info), .api_version = PC_API_VERSION};
    info.flags = PC_OWN_CONTEXT;
    pc_instance* instance = NULL;
    const pc_result result = pc_create(&info, &instance);
    printf("%s: %s\n", pc_result_name(result), pc_error());
    return result != PC_ERROR_CONTEXT || instance ||
           !strstr(pc_error(), "libGL.so.1 has no glXGetCurrentContext");
}
