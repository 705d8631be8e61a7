/* One frame through each shipped chain: a line with the hash of its pixels each, which must be the
 * same on every platform with the same driver. With SHIPPED the chains are those of
 * libpostchain_config, which have the same hashes. The library's own context replaces the
 * engine's. */
#ifdef SHIPPED
#include <postchain/chain_from_text.h>
#endif
#include <postchain/postchain.h>
#include <stdio.h>
#include <stdlib.h>

#include "host_gl.h"

enum { WIDTH = 160, HEIGHT = 100 };

static float color[HEIGHT][WIDTH][4], depth[HEIGHT][WIDTH], motion[HEIGHT][WIDTH][2];

/* Three surfaces, each with a motion and a depth of its own and a texture of noise. All values are
 * exact. */
static void fill(void) {
    uint32_t seed = 1;
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x) {
            const int near_disc = (x - 60) * (x - 60) + (y - 45) * (y - 45) < 400;
            const int bar = x >= 90 && x < 120 && y >= 20;
            for (int c = 0; c < 4; ++c) {
                seed = seed * 1664525u + 1013904223u;
                color[y][x][c] = c == 3 ? 1.0f : (float)(seed >> 24) / (near_disc ? 16.0f : 256.0f);
            }
            depth[y][x] = near_disc ? 0.5f : bar ? 0.125f : 0.03125f; /* 1 / scene units */
            motion[y][x][0] = near_disc ? 14.0f : bar ? -6.5f : 1.25f;
            motion[y][x][1] = near_disc ? -5.0f : bar ? 2.0f : 0.0f;
        }
}

static void number(pc_chain* chain, uint32_t pass, const char* key, double value) {
    if (pc_chain_set_number(chain, pass, key, value) != PC_OK)
        fprintf(stderr, "%s\n", pc_error()), exit(1);
}
static void text(pc_chain* chain, uint32_t pass, const char* key, const char* value) {
    if (pc_chain_set_text(chain, pass, key, value) != PC_OK)
        fprintf(stderr, "%s\n", pc_error()), exit(1);
}

/* The values of config/chains/paper.yaml, with its passes at these places. */
static void set_paper(pc_chain* chain, uint32_t blur, uint32_t fxaa, uint32_t depth_of_field) {
    text(chain, blur, "mode", "guertin");
    number(chain, blur, "samples", 25);
    number(chain, blur, "max_blur_px", 40);
    number(chain, blur, "jitter", 0.95);
    number(chain, blur, "center_weight", 40);
    number(chain, blur, "variance_threshold_px", 1.5);
    number(chain, fxaa, "preset", 12);
    text(chain, fxaa, "hint", "checkerboard");
    text(chain, fxaa, "hint_gate", "tile");
    text(chain, depth_of_field, "method", "gilham");
    text(chain, depth_of_field, "coc", "lens");
    number(chain, depth_of_field, "downsample", 4);
    text(chain, depth_of_field, "leak", "coc");
}

static uint64_t hash(const pc_texture* result) {
    static unsigned char pixels[HEIGHT * WIDTH * 16];
    GL_FUNCTION(PFNGLGETTEXTUREIMAGEPROC, glGetTextureImage)
    (result->name, 0, GL_RGBA, GL_FLOAT, sizeof(pixels), pixels);
    uint64_t value = 14695981039346656037u; /* FNV-1a */
    for (size_t i = 0; i < sizeof(pixels); ++i) value = (value ^ pixels[i]) * 1099511628211u;
    return value;
}

static const struct {
    const char *name, *passes;
} chains[] = {{"realtime", "tier:realtime"},
              {"fast", "tier:fast"},
              {"balanced", "tier:balanced"},
              {"best", "tier:best"},
              {"paper", "motion_blur,fxaa,depth_of_field"},
              {"dof_first", "depth_of_field,motion_blur,fxaa"}};

static pc_result make_chain(size_t number, pc_chain** chain) {
#ifdef SHIPPED
    if (number > 0) { /* realtime is a tier alone */
        const pc_result shipped = pc_chain_shipped(chains[number].name, chain);
        if (shipped == PC_OK && (number == 1 || number == 2)) /* a tier filters every pixel */
            text(*chain, 1, "where", "everywhere");
        return shipped;
    }
#endif
    const pc_result result = pc_chain_create(chains[number].passes, chain);
    if (result == PC_OK && number == 4) set_paper(*chain, 0, 1, 2);
    if (result == PC_OK && number == 5) set_paper(*chain, 1, 2, 0);
    return result;
}

int main(void) {
    pc_create_info info = {.struct_size = sizeof(info), .api_version = PC_API_VERSION};
    info.flags = PC_OWN_CONTEXT;
    pc_instance* instance = NULL;
    if (pc_create(&info, &instance) != PC_OK) {
        fprintf(stderr, "%s\n", pc_error());
        return 1;
    }
    fill();
    pc_frame frame = {.struct_size = sizeof(frame)};
    frame.color = make_texture(GL_RGBA32F, GL_RGBA, WIDTH, HEIGHT, &color[0][0][0]);
    frame.depth = make_texture(GL_R32F, GL_RED, WIDTH, HEIGHT, &depth[0][0]);
    frame.motion = make_texture(GL_RG32F, GL_RG, WIDTH, HEIGHT, &motion[0][0][0]);
    frame.depth_encoding = PC_DEPTH_INVERSE;
    frame.flags = PC_TOP_LEFT | PC_MOTION_TO_NEXT;
    frame.shutter_frames = 0.5f;
    frame.focal_length_mm = 85;
    frame.sensor_width_mm = 36;
    frame.f_stop = 1.4f;
    frame.focus_distance = 8;
    frame.meters_per_unit = 1;
    for (size_t i = 0; i < sizeof(chains) / sizeof(chains[0]); ++i) {
        pc_chain* chain = NULL;
        pc_texture result;
        if (make_chain(i, &chain) != PC_OK) {
            fprintf(stderr, "%s\n", pc_error());
            return 1;
        }
        if (pc_prepare(instance, chain, &frame, 1) != PC_OK ||
            pc_run(instance, chain, &frame, &result) != PC_OK) {
            fprintf(stderr, "%s\n", pc_last_error(instance));
            return 1;
        }
        printf("%-9s %016llx\n", chains[i].name, (unsigned long long)hash(&result));
        pc_chain_destroy(chain);
    }
    pc_destroy(instance);
    return 0;
}
