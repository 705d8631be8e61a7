#version 450 core
// Makes the fill mask of a frame that no pass has filled (chain/layers.h).
#include "common/work_group.glsl"
#include "shared/guest_uniforms.h"

layout(binding = 0) writeonly uniform image2DArray mask;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    imageStore(mask, ivec3(p, 0), vec4(1.0, 0.0, 0.0, 0.0));
}
