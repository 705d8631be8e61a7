/* A chain from text, with libpostchain_config, and the error of an invalid text. */
#include <postchain/chain_from_text.h>
#include <stdio.h>
#include <string.h>

int main(void) {
    const char* text =
        "postchain: 1\n"
        "passes:\n"
        "  - fxaa: {preset: 29}\n"
        "  - motion_blur: {samples: 25}\n";
    pc_chain* chain = NULL;
    if (pc_chain_from_text(text, "mine.yaml", &chain) != PC_OK) {
        fprintf(stderr, "%s\n", pc_error());
        return 1;
    }
    pc_parameter row = {.struct_size = sizeof(row)};
    int found = 0;
    for (uint32_t i = 0; pc_chain_parameter(chain, i, &row) == PC_OK; ++i)
        if (row.pass == 1 && strcmp(row.key, "samples") == 0) found = row.value == 25;
    /* libpostchain changes the chain that libpostchain_config has made. */
    if (pc_chain_set_number(chain, 1, "samples", 51) != PC_OK) found = 0;
    pc_chain_destroy(chain);
    if (pc_chain_from_text("postchain: 1\npasses: [blurr]\n", "bad.yaml", &chain) != PC_ERROR_CHAIN)
        found = 0;
    printf("%d %s\n", found, pc_error());
    return found && strstr(pc_error(), "bad.yaml:2:10: error: ") ? 0 : 1;
}
