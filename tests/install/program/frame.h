/* The frame of both examples: a white square on black, in front of a far wall, moving to the right.
 */
#ifndef FRAME_H
#define FRAME_H
#include "host_gl.h"

enum { FRAME_WIDTH = 64, FRAME_HEIGHT = 48 };

/* Sets the members that an engine renders. The textures belong to the current context. */
static void make_frame(pc_frame* frame) {
    static float color[FRAME_HEIGHT][FRAME_WIDTH][4], depth[FRAME_HEIGHT][FRAME_WIDTH],
        motion[FRAME_HEIGHT][FRAME_WIDTH][2];
    for (int y = 0; y < FRAME_HEIGHT; ++y)
        for (int x = 0; x < FRAME_WIDTH; ++x) {
            const int square = y >= 16 && y < 32 && x >= 24 && x < 40;
            for (int c = 0; c < 4; ++c) color[y][x][c] = square || c == 3 ? 1.0f : 0.0f;
            depth[y][x] = square ? 0.25f : 10.0f; /* scene units */
            motion[y][x][0] = square ? 20.0f : 0.0f;
        }
    frame->color = make_texture(GL_RGBA32F, GL_RGBA, FRAME_WIDTH, FRAME_HEIGHT, &color[0][0][0]);
    frame->depth = make_texture(GL_R32F, GL_RED, FRAME_WIDTH, FRAME_HEIGHT, &depth[0][0]);
    frame->motion = make_texture(GL_RG32F, GL_RG, FRAME_WIDTH, FRAME_HEIGHT, &motion[0][0][0]);
    frame->depth_encoding = PC_DEPTH_LINEAR;
    frame->flags = PC_MOTION_TO_NEXT;
    frame->shutter_frames = 1;
}

/* The square has spread to half a streak's length from its edge, and not upward. */
static int is_blurred(const pc_texture* result) {
    static float pixels[FRAME_HEIGHT][FRAME_WIDTH][4];
    GL_FUNCTION(PFNGLGETTEXTUREIMAGEPROC, glGetTextureImage)
    (result->name, 0, GL_RGBA, GL_FLOAT, sizeof(pixels), pixels);
    return pixels[24][42][0] > 0 && pixels[24][42][0] < 1 && pixels[8][32][0] == 0;
}
#endif
