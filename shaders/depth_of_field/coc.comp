#version 450 core
// Signed radius of the circle of confusion in pixels, from the inverse depth w.
// Equations: passes/depth_of_field/circle_of_confusion.h. COC_LENS or COC_PLANES is defined.
//
//   inverse_depth -> coc
//                 -> row_range   RANGE: smallest and largest |R| of each run of kBlockPx pixels;
//                                then one thread does a run
#include "common/work_group.glsl"
#include "shared/depth_of_field_block.h"

layout(binding = 0) uniform sampler2D inverse_depth;
layout(binding = 0) writeonly uniform image2D coc;
#ifdef RANGE
layout(binding = 1) writeonly uniform image2D row_range;
#endif

float radius_at(ivec2 p) {
    float w = texelFetch(inverse_depth, p, 0).x;
    // NaN and negative count as sky; an infinite w (d = 0) as the largest number, so that no
    // product below is 0 times infinity.
    w = w > 0.0 ? min(w, 3.0e38) : 0.0;
#if defined(COC_LENS)
    float radius = block.gain_px * (block.focus_inverse - w);
#elif defined(COC_PLANES)
    float near_part = 0.0;
    float far_part = 1.0;  // of the sky
    if (w > 0.0) {
        float d = 1.0 / w;
        near_part = clamp((block.near_sharp - d) * block.near_inverse_span, 0.0, 1.0);
        far_part = clamp((d - block.far_sharp) * block.far_inverse_span, 0.0, 1.0);
    }
    float radius = block.far_radius_px * far_part - block.near_radius_px * near_part;
#endif
    return clamp(radius, -block.max_radius_px, block.max_radius_px);
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
