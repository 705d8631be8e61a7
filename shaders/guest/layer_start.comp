#version 450 core
// Makes the frame's only layer, which the passes filter like color.
//
// SHARPNESS: 1: 1 and -1 in turn. It keeps its value where nothing is blurred, and tends to 0 where a
//            pixel is the mean of others. 0: the fill mask of a frame that no pass has filled
//            (chain/frame/layers.h)
#include "common/work_group.glsl"
#include "shared/guest_uniforms.h"

layout(binding = 0) writeonly uniform image2DArray layer;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
#if SHARPNESS
    const float start = ((p.x + p.y) & 1) == 0 ? 1.0 : -1.0;
#else
    const float start = 1.0;
#endif
    imageStore(layer, ivec3(p, 0), vec4(start, 0.0, 0.0, 0.0));
}
