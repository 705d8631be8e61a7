#version 450 core
// The table of lens samples.
//
//   -> lens_points   points of a set by sets; x, y in [-1, 1]
#include "common/work_group.glsl"
#include "shared/lens_points_uniforms.h"

layout(binding = 0) writeonly uniform image2D lens_points;

void main() {
    const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (at.x >= uniforms.points || at.y >= uniforms.sets) return;
    const int index = at.y * uniforms.points + at.x;
    const int pair = uniforms.packed_points[index >> 2][index & 3];
    const vec2 point = vec2(float((pair << 16) >> 16), float(pair >> 16)) / 32767.0;
    imageStore(lens_points, at, vec4(point, 0.0, 0.0));
}
