#version 450 core
// The inverse depth at each place that passes focus at: the median around it, as
// chain/pass/depth_at.h finds it on the CPU. One work group, an invocation for each candidate.
//
// ARRAYS: which of the host's textures are arrays
#include "guest/depth.glsl"

layout(std430, binding = 0) writeonly buffer Depths {
    vec4 depths[];  // one for each slot
};

// A grid of candidates, of which those count that are within the radius and the frame.
const int kAround = 4, kWindow = 2 * kAround + 1, kCandidates = kWindow * kWindow;

shared float found[kCandidates];  // -1: it does not count

// The depth of a candidate of place i.
float candidate(int i, int number) {
    const int x = number % kWindow - kAround, y = number / kWindow - kAround;
    const int radius = uniforms.focus[i].z;
    const bool near =
        radius == 0 ? max(abs(x), abs(y)) <= 2 : x * x + y * y <= kAround * kAround;
    const ivec2 p =
        uniforms.focus[i].xy + (radius == 0 ? ivec2(x, y) : ivec2(x, y) * radius / kAround);
    if (!near || any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, uniforms.full_size)))
        return -1.0;
    const float stored = stored_depth(p);
    return is_finite(stored) ? inverse_depth_of(stored) : -1.0;
}

// Is the candidate the median, and of several that equal it the first?
bool is_median(int number) {
    const float own = found[number];
    int count = 0, below = 0, equal = 0, equal_before = 0;
    for (int other = 0; other < kCandidates; ++other) {
        if (found[other] < 0.0) continue;
        ++count;
        below += int(found[other] < own);
        equal += int(found[other] == own);
        equal_before += int(found[other] == own && other < number);
    }
    return own >= 0.0 && below <= count / 2 && count / 2 < below + equal && equal_before == 0;
}

void main() {
    const int number = int(gl_LocalInvocationIndex);
    for (int i = 0; i < uniforms.focus_count; ++i) {
        if (number < kCandidates) found[number] = candidate(i, number);
        if (number == 0) depths[uniforms.focus_slot][i] = 0.0;  // if no candidate counts
        memoryBarrierBuffer();
        barrier();
        if (number < kCandidates && is_median(number))
            depths[uniforms.focus_slot][i] = found[number];
        barrier();
    }
}
