#version 450 core
// c (1 - strength t), t = squared distance from the center over that of the corners.
//
//   color -> color
#include "common/work_group.glsl"
#include "shared/vignette_block.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D darkened;

void main() {
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, block.size))) return;
    const vec2 from_center = vec2(2 * p + 1 - block.size);  // half pixels
    const vec2 corner = vec2(block.size);
    const float t = dot(from_center, from_center) / dot(corner, corner);
    const float kept = 1.0 - block.strength * t;
    const vec4 c = texelFetch(color, p, 0);
    imageStore(darkened, p, vec4(c.rgb * kept, block.alpha != 0 ? c.a * kept : c.a));
}
