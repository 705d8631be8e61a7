#version 450 core
// The table of lens samples.
//
//   -> lens_samples   points of a set by sets; x, y in [-1, 1]; z: the order of its time
#include "common/work_group.glsl"
#include "shared/lens_samples_uniforms.h"

layout(binding = 0) writeonly uniform image2D lens_samples;

// The place of k among 0 .. n - 1 in the order of their mirrored binary digits.
int mirrored_place(int k, int n) {
    int place = 0;
    // For each digit 1 of k, the numbers that have the lower digits of k and then 0.
    for (int digit = 0; k >> digit != 0; ++digit) {
        const int lower = k & ((1 << digit) - 1);
        place += (k >> digit & 1) * (((n - 1 - lower) >> (digit + 1)) + 1);
    }
    return place;
}

void main() {
    const ivec2 at = invocation_at();
    if (at.x >= uniforms.points || at.y >= uniforms.sets) return;
    const int index = at.y * uniforms.points + at.x;
    const int pair = uniforms.packed_points[index >> 2][index & 3];
    precise const vec2 point = vec2(float((pair << 16) >> 16), float(pair >> 16)) / 32767.0;
    imageStore(lens_samples, at, vec4(point, float(mirrored_place(at.x, uniforms.points)), 0.0));
}
