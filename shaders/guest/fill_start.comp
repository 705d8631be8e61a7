#version 450 core
// Makes the fill mask of a frame that no pass has filled (chain/layers.h).
#include "common/work_list.glsl"

layout(binding = 0) writeonly uniform image2DArray mask;

void main() {
    ivec2 p;
    if (next_pixel(imageSize(mask).xy, p))
        imageStore(mask, ivec3(p, 0), vec4(1.0, 0.0, 0.0, 0.0));
}
