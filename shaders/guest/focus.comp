#version 450 core
// The inverse depth at each place that passes focus at: the median around it, as
// chain/pass/depth_at.h finds it on the CPU. One invocation for each place.
//
// ARRAYS: which of the host's textures are arrays
#include "guest/depth.glsl"

layout(std430, binding = 0) writeonly buffer Depths {
    vec4 depths[];  // one for each slot
};

// A grid of places, of which those count that are within the radius and the frame.
const int kAround = 4, kWindow = 2 * kAround + 1;

void main() {
    const int i = int(gl_LocalInvocationIndex);
    if (i >= uniforms.focus_count) return;
    const ivec2 center = uniforms.focus[i].xy;
    const int radius = uniforms.focus[i].z;
    float found[kWindow * kWindow];
    int count = 0;
    for (int y = -kAround; y <= kAround; ++y)
        for (int x = -kAround; x <= kAround; ++x) {
            const bool near = radius == 0 ? max(abs(x), abs(y)) <= 2
                                          : x * x + y * y <= kAround * kAround;
            const ivec2 p = center + (radius == 0 ? ivec2(x, y) : ivec2(x, y) * radius / kAround);
            if (!near || any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, uniforms.full_size)))
                continue;
            const float stored = stored_depth(p);
            if (is_finite(stored)) found[count++] = inverse_depth_of(stored);
        }
    float median = 0.0;
    for (int a = 0; a < count; ++a) {
        int below = 0, equal = 0;
        for (int b = 0; b < count; ++b) {
            below += int(found[b] < found[a]);
            equal += int(found[b] == found[a]);
        }
        if (below <= count / 2 && count / 2 < below + equal) median = found[a];
    }
    depths[uniforms.focus_slot][i] = median;
}
