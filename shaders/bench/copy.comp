#version 450 core
// A plain copy, one fetch and one store a pixel: what tests/bench measures every pass against.
#include "common/work_group.glsl"

layout(binding = 0) uniform sampler2D source;
layout(binding = 0) writeonly uniform image2D result;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, imageSize(result)))) return;
    imageStore(result, p, texelFetch(source, p, 0));
}
