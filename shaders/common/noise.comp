#version 450 core
// Table of random numbers, 128 x 128, repeated over the frame. NOISE 0: Halton over Morton order;
// 1: interleaved gradient noise in 0.32 fixed point; 2: blue noise. Described in
// passes/common/noise.h.
//
//   -> noise   x: tile value in [0, 1), y: tap value in [-1, 1)
#include "common/work_group.glsl"
#include "shared/noise_uniforms.h"

layout(binding = 0) writeonly uniform image2D noise;

uint spread_bits(uint x) {
    x = (x | (x << 4)) & 0x0f0fu;
    x = (x | (x << 2)) & 0x3333u;
    return (x | (x << 1)) & 0x5555u;
}

vec2 halton(uvec2 p) {
    uint index = spread_bits(p.x) | (spread_bits(p.y) << 1);
    const float tile = float(bitfieldReverse(index) >> 18) / 16384.0;
    uint mirrored = 0u;  // nine ternary digits hold 16384 numbers
    for (int digit = 0; digit < 9; ++digit) {
        mirrored = 3u * mirrored + index % 3u;
        index /= 3u;
    }
    precise const float tap = float(mirrored) / 19683.0;
    return vec2(tile, tap);
}

// The upper half of a product, which HLSL has no function for.
uint high_product(uint a, uint b) {
    const uvec2 x = uvec2(a & 0xffffu, a >> 16), y = uvec2(b & 0xffffu, b >> 16);
    const uint middle = x.y * y.x + (x.x * y.x >> 16);  // below 2^32, as the next one
    const uint other = x.x * y.y + (middle & 0xffffu);
    return x.y * y.y + (middle >> 16) + (other >> 16);
}

float gradient_noise(uvec2 p) {
    const uint inner = 288237660u * p.x + 25070368u * p.y;
    const uint high = high_product(inner, 4221604530u);
    return float((52u * inner + high) >> 8) / 16777216.0;
}

#if NOISE == 2
float blue(uvec2 p) {
    const uint pixel = (p.y & 63u) * 64u + (p.x & 63u);
    const uint pair = uint(uniforms.ranks[pixel >> 3][(pixel >> 1) & 3u]);
    const uint rank = (pixel & 1u) == 0u ? pair & 0xffffu : pair >> 16;
    precise const float value = (float(rank) + 0.5) / 4096.0;
    return value;
}
#endif

void main() {
    const uvec2 p = (uvec2(invocation_at()) + uvec2(uniforms.shift)) & 127u;
#if NOISE == 0
    const vec2 value = halton(p);
#elif NOISE == 1
    const vec2 value = vec2(gradient_noise(p), gradient_noise(p.yx + uvec2(37u, 11u)));
#else
    const vec2 value = vec2(blue(p), blue(p + uvec2(29u, 41u)));
#endif
    precise const vec4 stored = vec4(value.x, 2.0 * value.y - 1.0, 0, 0);
    imageStore(noise, invocation_at(), stored);
}
