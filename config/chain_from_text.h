/* A guest's chain from the text of a chain file (docs/chain_file.md). C11 and C++20. Only for hosts
 * that link the config library (libyaml). */
#ifndef POSTCHAIN_CHAIN_FROM_TEXT_H
#define POSTCHAIN_CHAIN_FROM_TEXT_H
#include <postchain/postchain.h>
#ifdef __cplusplus
extern "C" {
#endif
/* `text`: YAML or JSON, ends with 0. `name`: file name for messages; may be NULL.
 * PC_ERROR_CHAIN: pc_error() has a line for each fault, with its place. */
PC_API pc_result pc_chain_from_text(const char* text, const char* name, pc_chain** chain);
/* A chain that is part of the library: "paper", "balanced", "fast", ... */
PC_API pc_result pc_chain_shipped(const char* name, pc_chain** chain);
#ifdef __cplusplus
}
#endif
#endif
