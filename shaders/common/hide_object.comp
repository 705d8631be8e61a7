#version 450 core
// Depth of a neighboring frame, below 0 at an object that counts as standing still, so that a
// search does not find it (docs/frame.md).
//
//   inverse_depth, mattes -> beside_object
//
// MATTE: index of the pass's matte
#include "common/matte.glsl"
#include "common/work_group.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2D inverse_depth;
layout(binding = 1) uniform sampler2DArray mattes;
layout(binding = 0) writeonly uniform image2D beside_object;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const float q = texelFetch(inverse_depth, p, 0).x;
    imageStore(beside_object, p, vec4(matte_at(p) > 0.0 ? -1.0 : q > 0.0 ? q : 0.0));
}
