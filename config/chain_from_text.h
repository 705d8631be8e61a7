/* A guest's chain from the text of a chain file (docs/chain_file.md). C11 and C++20, an addition to
 * postchain.h for hosts that link the config library (yaml-cpp). */
#ifndef POSTCHAIN_CHAIN_FROM_TEXT_H
#define POSTCHAIN_CHAIN_FROM_TEXT_H
#include <postchain/postchain.h>
#ifdef __cplusplus
extern "C" {
#endif
/* `text`: YAML or JSON, zero-terminated. `name`: file name for messages; may be NULL.
 * PC_ERROR_CHAIN: pc_create_error() lists every fault with its place, one per line. */
PC_API pc_result pc_chain_from_text(const char* text, const char* name, pc_chain** chain);
/* A chain that is built into the library: "paper", "balanced", "fast", ... */
PC_API pc_result pc_chain_shipped(const char* name, pc_chain** chain);
#ifdef __cplusplus
}
#endif
#endif
