#version 450 core
// Packs the surfaces of the layer behind (chain/frame/behind.h), beside those of the frame.
//
//   behind -> surfaces, the second half
//
// SECOND_LAYER: defined
#include "common/work_group.glsl"

#include "inverse_warp/planes.glsl"

#include "inverse_warp/half.glsl"

layout(binding = 0) writeonly uniform uimage2D surfaces;

void main() {
    const ivec2 p = kBlockPx * group_at() + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(p, uniforms.size))) return;
    imageStore(surfaces, in_half(p), pack_surface(surface_at(p)));
}
