#version 450 core
// A layer of 1 and -1 in turn. Filtered like color it shows how sharp a pixel still is: it keeps
// its value where nothing is blurred, and tends to 0 where a pixel is the mean of others.
#include "common/work_group.glsl"
#include "shared/guest_uniforms.h"

layout(binding = 0) writeonly uniform image2DArray layer;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    imageStore(layer, ivec3(p, 0), vec4(((p.x + p.y) & 1) == 0 ? 1.0 : -1.0, 0.0, 0.0, 0.0));
}
