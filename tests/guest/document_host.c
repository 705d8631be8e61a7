/* The code of docs/integration.md, as written: every frame's flags are those of the conventions,
 * and PC_CAMERA_CUT at a cut alone. */
#include <epoxy/gl.h>
#include <postchain/postchain.h>
#include <stdio.h>
#include <stdlib.h>

static void report(const char* text) {
    fprintf(stderr, "%s\n", text);
    exit(1);
}

static GLuint make_texture(GLenum format, int width, int height) {
    GLuint name;
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    glTextureStorage2D(name, 1, format, width, height);
    return name;
}

static GLuint shown;
static void show(pc_texture picture) {
    shown = picture.name;
}

int main(void) {
    pc_create_info own = {.struct_size = sizeof(own), .api_version = PC_API_VERSION};
    own.flags = PC_OWN_CONTEXT;
    pc_instance* context;
    if (pc_create(&own, &context) != PC_OK) report(pc_error());
    const int width = 64, height = 48;
    const GLuint color = make_texture(GL_RGBA16F, width, height),
                 depth = make_texture(GL_DEPTH_COMPONENT32F, width, height),
                 motion = make_texture(GL_RG16F, width, height),
                 result = make_texture(GL_RGBA16F, width, height);
#include "integration_1.inc"
    if (pc_use_conventions("bevy", &frame) != PC_OK) report(pc_error());
    frame.flags |= PC_CAMERA_CUT | PC_HALF_PLANES;
    const pc_frame_flags flags = frame.flags;
    if (pc_prepare(instance, chain, &frame, 1) != PC_OK) report(pc_error());
    for (uint64_t n = 0; n < 3; ++n) {
        const int cut = n == 1;
#include "integration_2.inc"
        if (shown != result) report("the frame does not show its output");
        if (frame.flags != (cut ? flags : flags & ~(uint32_t)PC_CAMERA_CUT))
            report("the frame loop changes other flags than PC_CAMERA_CUT");
    }
#include "integration_3.inc"
    /* The loop with the frame before. */
    struct {
        pc_texture color, depth, motion;
    } sets[2];
    for (int i = 0; i < 2; ++i) {
        sets[i].color =
            (pc_texture){make_texture(GL_RGBA16F, width, height), GL_RGBA16F, width, height};
        sets[i].depth = frame.depth;
        sets[i].motion = frame.motion;
    }
    pc_frame last = frame;
    pc_texture picture;
    frame.flags &= ~(uint32_t)PC_CAMERA_CUT;
    frame.before = &last;
    if (pc_prepare(instance, chain, &frame, 1) != PC_OK) report(pc_error());
    for (uint64_t n = 0; n < 3; ++n) {
#include "integration_4.inc"
    }
    pc_chain_destroy(chain);
    pc_destroy(instance);
    pc_destroy(context);
    return 0;
}
