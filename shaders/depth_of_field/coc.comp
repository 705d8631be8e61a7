#version 450 core
// Signed radius of the circle of confusion in pixels.
//
//   inverse_depth -> coc
//                 -> row_range   RANGE: smallest and largest |R| of each run of kBlockPx pixels;
//                                then one thread does a run
#include "common/work_group.glsl"
#include "shared/depth_of_field_block.h"

#include "common/circle_of_confusion.glsl"

layout(binding = 0) uniform sampler2D inverse_depth;
layout(binding = 0) writeonly uniform image2D coc;
#ifdef RANGE
layout(binding = 1) writeonly uniform image2D row_range;
#endif

float radius_at(ivec2 p) {
    return radius_px(texelFetch(inverse_depth, p, 0).x);
}

void main() {
#ifdef RANGE
    const ivec2 run = ivec2(gl_GlobalInvocationID.xy);
    if (kBlockPx * run.x >= block.size.x || run.y >= block.size.y) return;
    const int end = min(kBlockPx * run.x + kBlockPx, block.size.x);
    vec2 range = vec2(block.max_radius_px, 0.0);
    for (int x = kBlockPx * run.x; x < end; ++x) {
        const float radius = radius_at(ivec2(x, run.y));
        imageStore(coc, ivec2(x, run.y), vec4(radius, 0.0, 0.0, 0.0));
        range = vec2(min(range.x, abs(radius)), max(range.y, abs(radius)));
    }
    imageStore(row_range, run, vec4(range, 0.0, 0.0));
#else
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, block.size))) return;
    imageStore(coc, p, vec4(radius_at(p), 0.0, 0.0, 0.0));
#endif
}
