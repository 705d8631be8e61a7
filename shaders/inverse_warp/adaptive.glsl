// Adaptive sampling: do the first samples of a tile disagree, so that it takes more? A pixel's samples
// are told by halves, because one pixel's alone say too little (docs/inverse_warp.md). A work group is
// a tile, and all of it calls begin_tile() and share_of_more_in().
#include "shared/inverse_warp_uniforms.h"

// The sum over a tile's pixels, in whole numbers: their order does not count.
shared uint tile_noise;
const float kNoiseSteps = 1048576.0;

// What two halves of a pixel's samples have seen: their differences to the pixel's own color.
struct Halves {
    vec3 sum[2];
    float weight[2];
};

// Samples whose number has as many digits 1: both halves are even over the shutter, whose times go
// by mirrored digits, and over the lens, whose points go outward (Thue-Morse).
void add_to_half(inout Halves halves, int k, vec4 difference, float weight) {
    const bool odd = (bitCount(k) & 1) == 1;
    halves.sum[0] += odd ? vec3(0.0) : weight * difference.rgb;
    halves.sum[1] += odd ? weight * difference.rgb : vec3(0.0);
    halves.weight[0] += odd ? 0.0 : weight;
    halves.weight[1] += odd ? weight : 0.0;
}

vec3 shown(vec3 color) {
    const vec3 light = max(color, vec3(0.0));
    return sqrt(light / (1.0 + light));
}

// Of the pixel's samples, from the difference of the halves: mean of red, green and blue, as shown.
float noise_of(Halves halves, vec3 own) {
    if (halves.weight[0] == 0.0 || halves.weight[1] == 0.0) return 0.0;
    const vec3 d = shown(own + halves.sum[0] / halves.weight[0]) -
                   shown(own + halves.sum[1] / halves.weight[1]);
    const float squared = dot(d, d) / 3.0;
    return is_finite(squared) ? squared : 0.0;
}

void begin_tile() {
    if (gl_LocalInvocationIndex == 0u) tile_noise = 0u;
    barrier();
}

// The weight of each sample beyond the first `uniforms.samples`. noise: of this pixel
float share_of_more_in(ivec2 tile, float noise) {
    atomicAdd(tile_noise, uint(kNoiseSteps * noise + 0.5));
    barrier();
    const ivec2 extent = min(uniforms.size - kBlockPx * tile, ivec2(kBlockPx));
    const float mean = float(tile_noise) / (kNoiseSteps * float(extent.x * extent.y));
    return clamp((mean / uniforms.noise_limit - 1.0) * 4.0, 0.0, 1.0);
}
