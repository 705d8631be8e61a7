#version 450 core
// c + 1/4 (c - before) + 1/4 (c - after), a frame that is not there is black; of each neighbor 1/d
// is added to red, x of its motion to green, y of its motion back to blue (of color alone: layers that
// sum to color have that of none).
//
//   color, and the planes of the neighbors for which a macro is set -> color
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_group.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D mixed;
layout(binding = 1) uniform sampler2D color_before;
layout(binding = 2) uniform sampler2D inverse_depth_before;
layout(binding = 3) uniform sampler2D motion_before;
layout(binding = 4) uniform sampler2D motion_back_before;
layout(binding = 5) uniform sampler2D color_after;
layout(binding = 6) uniform sampler2D inverse_depth_after;
layout(binding = 7) uniform sampler2D motion_after;
layout(binding = 8) uniform sampler2D motion_back_after;
#ifdef LAYERS
layout(binding = 9) uniform sampler2DArray layers;
layout(binding = 10) uniform sampler2DArray layers_before;
layout(binding = 11) uniform sampler2DArray layers_after;
layout(binding = 1) writeonly uniform image2DArray layers_mixed;
#endif

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const vec4 c = finite_color(texelFetch(color, p, 0));
    vec4 sum = c;
#ifdef BEFORE
    sum += 0.25 * c;
#endif
#ifdef COLOR_BEFORE
    sum -= 0.25 * texelFetch(color_before, p, 0);
#endif
#ifdef INVERSE_DEPTH_BEFORE
    sum.r += texelFetch(inverse_depth_before, p, 0).x;
#endif
#ifdef MOTION_BEFORE
    sum.g += texelFetch(motion_before, p, 0).x;
#endif
#ifdef MOTION_BACK_BEFORE
    sum.b += texelFetch(motion_back_before, p, 0).y;
#endif
#ifdef AFTER
    sum += 0.25 * c;
#endif
#ifdef COLOR_AFTER
    sum -= 0.25 * texelFetch(color_after, p, 0);
#endif
#ifdef INVERSE_DEPTH_AFTER
    sum.r += texelFetch(inverse_depth_after, p, 0).x;
#endif
#ifdef MOTION_AFTER
    sum.g += texelFetch(motion_after, p, 0).x;
#endif
#ifdef MOTION_BACK_AFTER
    sum.b += texelFetch(motion_back_after, p, 0).y;
#endif
    STORE(mixed, p, sum);
#ifdef LAYERS
    FOR_LAYERS(i) {
        const vec4 own = LAYER_FETCH(layers, p, i);
        vec4 set_off = own;
#ifdef BEFORE
        set_off += 0.25 * own;
#endif
#ifdef LAYERS_BEFORE
        set_off -= 0.25 * LAYER_FETCH(layers_before, p, i);
#endif
#ifdef AFTER
        set_off += 0.25 * own;
#endif
#ifdef LAYERS_AFTER
        set_off -= 0.25 * LAYER_FETCH(layers_after, p, i);
#endif
        LAYER_STORE(layers_mixed, p, i, set_off);
    }
#endif
}
