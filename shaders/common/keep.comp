#version 450 core
// Blocks that nothing moves into keep their color, bit for bit, and have no hint.
//
//   color -> color [, hint]   in the blocks of the list
#include "common/work_list.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D kept;
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif

void main() {
    ivec2 p;
    if (!next_pixel(textureSize(color, 0), p)) return;
    imageStore(kept, p, texelFetch(color, p, 0));
#if HINT
    imageStore(hint, p, vec4(0.0));
#endif
}
