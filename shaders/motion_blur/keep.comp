#version 450 core
// Blocks that nothing moves into keep their color, bit for bit, and have no hint.
//
//   color -> color [, hint]   in the blocks of the list
layout(local_size_x = 16, local_size_y = 16) in;

#include "common/work_list.glsl"
#include "shared/motion_blur_block.h"

layout(std430, binding = 0) readonly buffer Blocks { WORK_LIST } list;
layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D kept;
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif

void main() {
    if (!take_work(list.count)) return;
    const ivec2 p = pixel_of_work(list.blocks[work_index()]);
    if (any(greaterThanEqual(p, block.size))) return;
    imageStore(kept, p, texelFetch(color, p, 0));
#if HINT
    imageStore(hint, p, vec4(0.0));
#endif
}
