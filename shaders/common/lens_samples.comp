#version 450 core
// The table of lens samples.
//
//   -> lens_samples   points of a set by sets; x, y in [-1, 1]
#include "common/work_group.glsl"
#include "shared/lens_samples_uniforms.h"

layout(binding = 0) writeonly uniform image2D lens_samples;

void main() {
    const ivec2 at = invocation_at();
    if (at.x >= uniforms.points || at.y >= uniforms.sets) return;
    const int index = at.y * uniforms.points + at.x;
    const int pair = uniforms.packed_points[index >> 2][index & 3];
    const vec2 point = vec2(float((pair << 16) >> 16), float(pair >> 16)) / 32767.0;
    imageStore(lens_samples, at, vec4(point, 0.0, 0.0));
}
