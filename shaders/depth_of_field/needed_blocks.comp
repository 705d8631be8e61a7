#version 450 core
// Finds the blocks of the downsampled image that are read. One thread per block of 16 x 16 of its
// pixels.
//
//   blurs (of the image's blocks), or needed (of the downsampled image's) -> needed, work list
//
// A block's readers are the blocks over it, factor x factor of them, and those within reach.
#include "common/work_list.glsl"
#include "shared/depth_of_field_needed_uniforms.h"

layout(binding = 0) uniform sampler2D readers;
layout(binding = 0) writeonly uniform image2D needed;
layout(std430, binding = 0) buffer Blocks { WORK_LIST } list;

void main() {
    const ivec2 at = invocation_at();
    if (any(greaterThanEqual(at, uniforms.blocks))) return;
    const ivec2 low = uniforms.factor * at - uniforms.reach;
    const ivec2 high = uniforms.factor * (at + 1) - 1 + uniforms.reach;
    const ivec2 last = uniforms.reader_blocks - 1;
    bool read = false;
    for (int y = max(low.y, 0); y <= min(high.y, last.y); ++y)
        for (int x = max(low.x, 0); x <= min(high.x, last.x); ++x)
            read = read || texelFetch(readers, ivec2(x, y), 0).x > 0.0;
    imageStore(needed, at, vec4(read ? 1.0 : 0.0));
    if (read) ADD_TO_WORK_LIST(list, at);
}
