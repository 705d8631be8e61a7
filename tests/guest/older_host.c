/* A host that is older than the library: its structs are truncated. It must run as it did, whatever
 * members the structs have gained since. The bytes behind each struct belong to the host: they are set to 0xff, and the library must neither read nor write them. */
#include <postchain/postchain.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/install/program/frame.h"

static void expect(int holds, const char* what) {
    if (holds) return;
    fprintf(stderr, "does not hold: %s\n%s\n", what, pc_create_error());
    exit(1);
}
#define EXPECT(condition) expect(condition, #condition)

/* `size` bytes of a struct in a larger block of 0xff. */
enum { BLOCK = 4096 };
static void* host_struct(const void* values, size_t size, unsigned char behind) {
    unsigned char* block = malloc(BLOCK);
    EXPECT(block != NULL);
    memset(block, behind, BLOCK);
    memcpy(block, values, size);
    *(uint32_t*)block = (uint32_t)size;
    return block;
}
static int is_untouched(const void* block, size_t size) {
    for (size_t i = size; i < BLOCK; ++i)
        if (((const unsigned char*)block)[i] != 0xff) return 0;
    return 1;
}

static pc_instance* create(size_t size) {
    pc_create_info info = {.struct_size = sizeof(info), .api_version = PC_API_VERSION};
    info.flags = PC_OWN_CONTEXT;
    void* given = host_struct(&info, size, 0xff);
    pc_instance* instance = NULL;
    EXPECT(pc_create(given, &instance) == PC_OK);
    EXPECT(is_untouched(given, size));
    free(given);
    return instance;
}

/* Prepares and runs the frame with the first `size` bytes of its struct; the bytes behind the
 * struct are `behind`. */
static pc_result run(pc_instance* instance, pc_chain* chain, const pc_frame* frame, size_t size,
                     unsigned char behind, pc_texture* result) {
    void* given = host_struct(frame, size, behind);
    pc_result code = pc_prepare(instance, chain, given, 1);
    if (code == PC_OK) code = pc_run(instance, chain, given, result);
    free(given);
    return code;
}

static void check_frames(pc_instance* instance, pc_chain* chain) {
    pc_frame frame = {.struct_size = sizeof(frame)};
    make_frame(&frame);
    pc_texture result;
    EXPECT(run(instance, chain, &frame, sizeof(frame), 0xff, &result) == PC_OK);
    EXPECT(is_blurred(&result));
    /* Without the matrices and all that follows. */
    EXPECT(run(instance, chain, &frame, offsetof(pc_frame, view_projection), 0xff, &result) ==
           PC_OK);
    EXPECT(is_blurred(&result));
    /* A host of a later version: its further members are 0. */
    pc_frame later = frame;
    void* given = host_struct(&later, sizeof(later), 0);
    *(uint32_t*)given = BLOCK;
    EXPECT(pc_run(instance, chain, given, &result) == PC_OK);
    EXPECT(is_blurred(&result));
    /* One that is not 0 cannot be done. */
    ((unsigned char*)given)[BLOCK - 1] = 1;
    EXPECT(pc_run(instance, chain, given, &result) == PC_ERROR_VERSION);
    EXPECT(strstr(pc_last_error(instance), "pc_frame.struct_size is 4096") != NULL);
    free(given);

    void* whole = host_struct(&frame, sizeof(frame), 0xff);
    EXPECT(pc_use_conventions("falcor", whole) == PC_OK);
    EXPECT(is_untouched(whole, sizeof(frame)));
    EXPECT(((pc_frame*)whole)->depth_encoding == PC_DEPTH_FORWARD);
    EXPECT(((pc_frame*)whole)->motion_scale[0] == -FRAME_WIDTH);
    EXPECT(((pc_frame*)whole)->color.name == frame.color.name);
    EXPECT(((pc_frame*)whole)->shutter_frames == 1);
    free(whole);
}

static void check_parameters(pc_chain* chain) {
    const pc_parameter empty = {.struct_size = sizeof(empty)};
    pc_parameter* row = host_struct(&empty, sizeof(empty), 0xff);
    int samples = 0;
    for (uint32_t i = 0; pc_chain_parameter(chain, i, row) == PC_OK; ++i) {
        EXPECT(row->struct_size == sizeof(empty));
        EXPECT(row->cost <= PC_COST_TEXTURE);
        if (row->pass != 0 || strcmp(row->key, "samples") != 0) continue;
        samples = 1;
        EXPECT(strcmp(row->pass_name, "motion_blur") == 0 && strcmp(row->type, "integer") == 0);
        EXPECT(row->is_set && row->choice_count == 0 && row->max > row->min && row->value > 0);
        EXPECT(atof(row->text) == row->value);
    }
    EXPECT(samples);
    EXPECT(is_untouched(row, sizeof(empty)));
    free(row);

    const size_t size = offsetof(pc_parameter, cost);
    row = host_struct(&empty, size, 0xff);
    EXPECT(pc_chain_parameter(chain, 0, row) == PC_OK);
    EXPECT(row->struct_size == size && row->text != NULL && is_untouched(row, size));
    free(row);
}

static void check_reports(pc_instance* instance) {
    const pc_capabilities none = {.struct_size = sizeof(none)};
    pc_capabilities* can = host_struct(&none, sizeof(none), 0xff);
    EXPECT(pc_query(instance, can) == PC_OK && is_untouched(can, sizeof(none)));
    EXPECT(can->gl_version >= 45 && can->max_texture_px >= 1024);
    EXPECT(can->renderer[0] != 0 && strchr(can->version, '.') != NULL);
    EXPECT(can->api_version >= PC_API_VERSION && can->api_version >> 16 == PC_API_VERSION >> 16);
    free(can);

    const pc_counters zero = {.struct_size = sizeof(zero)};
    pc_counters* counters = host_struct(&zero, sizeof(zero), 0xff);
    EXPECT(pc_count(instance, counters) == PC_OK && is_untouched(counters, sizeof(zero)));
    EXPECT(counters->frames == 3 && counters->dispatches >= 3 && counters->programs > 0);
    EXPECT(counters->textures_alive > 0);
    EXPECT(counters->texture_bytes_peak >= counters->texture_bytes && counters->texture_bytes > 0);
    const uint64_t dispatches = counters->dispatches;
    free(counters);

    const size_t size = offsetof(pc_counters, barriers);
    counters = host_struct(&zero, size, 0xff);
    EXPECT(pc_count(instance, counters) == PC_OK && is_untouched(counters, size));
    EXPECT(counters->dispatches == dispatches);
    free(counters);
}

int main(void) {
    pc_destroy(create(offsetof(pc_create_info, texture_budget)));
    pc_instance* instance = create(sizeof(pc_create_info));
    pc_chain* chain = NULL;
    EXPECT(pc_chain_create("motion_blur", &chain) == PC_OK);
    check_frames(instance, chain);
    check_parameters(chain);
    check_reports(instance);
    pc_chain_destroy(chain);
    pc_destroy(instance);
    return 0;
}
