#version 450 core
// Many reads a pixel, at places within 8 px that differ from pixel to pixel: the cost of a kind of
// access (tests/bench/access_bench.cpp).
//
// ACCESS 0: none. 1: texelFetch(). 2: imageLoad(). 3: shared memory. 4: storage buffer.
#include "common/work_group.glsl"

#if ACCESS == 1
layout(binding = 0) uniform sampler2D source;
#elif ACCESS == 2
layout(binding = 1, rgba32f) readonly uniform image2D source;
#elif ACCESS == 4
layout(std430, binding = 0) readonly buffer Source { vec4 source[]; };
#endif
layout(binding = 0) writeonly uniform image2D result;

const int kReads = 32;
const int kReachPx = 8;

#if ACCESS == 3
shared vec4 source[kBlockPx * kBlockPx];
#endif

vec4 read_at(ivec2 p, ivec2 size) {
#if ACCESS == 1
    return texelFetch(source, p, 0);
#elif ACCESS == 2
    return imageLoad(source, p);
#elif ACCESS == 3
    return source[(p.y % kBlockPx) * kBlockPx + p.x % kBlockPx];
#elif ACCESS == 4
    return source[p.y * size.x + p.x];
#else
    return vec4(p, p);
#endif
}

void main() {
    const ivec2 p = invocation_at(), size = imageSize(result);
#if ACCESS == 3
    source[gl_LocalInvocationIndex] = vec4(p, p);
    barrier();
#endif
    if (any(greaterThanEqual(p, size))) return;
    uint random = uint(p.x * 1973 + p.y * 9277);
    vec4 sum = vec4(0.0);
    int i = 0;
    do {
        random = random * 1664525u + 1013904223u;
        const ivec2 offset = ivec2(int(random >> 28), int(random >> 24 & 15u)) - kReachPx;
        sum += read_at(clamp(p + offset, ivec2(0), size - 1), size);
    } while (++i < kReads);
    imageStore(result, p, vec4(sum.x + sum.y + sum.z + sum.w));
}
