#version 450 core
// FXAA, stage "luma": the number per pixel that makes every decision, in fp32 at any precision.
//
//   color --> luma
#include "common/finite.glsl"
#include "common/work_group.glsl"
#include "shared/fxaa_uniforms.h"
#include "fxaa/luma.glsl"

layout(binding = 0) uniform sampler2D color_plane;
layout(binding = 0) writeonly uniform image2D luma_plane;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const vec4 color = finite_color(texelFetch(color_plane, p, 0));
    imageStore(luma_plane, p, vec4(luma_of(color), 0.0, 0.0, 0.0));
}
