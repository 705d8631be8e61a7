#version 450 core
// Writes the lumas that are internal to FXAA's step (fxaa/luma.glsl) to a texture.
#include "common/finite.glsl"
#include "common/work_group.glsl"
#include "shared/fxaa_uniforms.h"
#include "fxaa/luma.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D luma;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    imageStore(luma, p, vec4(luma_of(finite_color(texelFetch(color, p, 0)).rgb), 0.0, 0.0, 0.0));
}
