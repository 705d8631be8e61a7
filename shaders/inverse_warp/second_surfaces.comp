#version 450 core
// Packs the surfaces of the layer behind (chain/behind.h), below those of the frame.
//
//   behind -> surfaces, rows uniforms.size.y and on
//
// SECOND_LAYER: defined
#include "common/work_group.glsl"

#include "inverse_warp/planes.glsl"

layout(binding = 0) writeonly uniform uimage2D surfaces;

void main() {
    const ivec2 p = kBlockPx * group_at() + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(p, uniforms.size))) return;
    imageStore(surfaces, p + ivec2(0, uniforms.size.y), pack_surface(surface_at(p)));
}
