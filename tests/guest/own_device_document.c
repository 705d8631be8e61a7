/* The code of docs/own_device.md, as written, compiles. */
#include <postchain/postchain_plan.h>

enum { COLOR = 1 };
void report(const char* text);
void use_your_own_color(const char* text);
void make_pipelines(const uint64_t* keys, uint32_t count);
void place_barriers(const pc_plan_barrier*, uint32_t count);
void bind(uint64_t program, const pc_plan_binding*, uint32_t count, uint32_t offset,
          uint32_t bytes);
void dispatch_indirect(uint32_t list);
void dispatch(const pc_plan_dispatch*);

void own_device_document(pc_chain*, int32_t, int32_t);
void own_device_document(pc_chain* chain, int32_t width, int32_t height) {
#include "own_device_1.inc"
}
