// Adaptive sampling: a block whose first samples disagree takes more. The decision is the block's,
// because the samples of one pixel say too little (docs/inverse_warp.md). A work group is a block,
// and all of it calls begin_block() and next_set(). Without ADAPTIVE there is one set.
#if ADAPTIVE
// The sum over a block's pixels, in whole numbers: their order does not count.
shared uint block_noise;
const float kNoiseSteps = 1048576.0;

vec3 shown(vec3 color) {
    const vec3 light = max(color, vec3(0.0));
    precise const vec3 part = light / (1.0 + light);
    return sqrt(part);
}

// Squared difference between the means of the two halves of a pixel's samples, as shown: mean of
// red, green and blue. Their colors are differences to `base`.
float noise_of(Half even, Half odd, vec3 base) {
    if (even.weight == 0.0 || odd.weight == 0.0) return 0.0;
    precise const vec3 first = base + even.color / even.weight;
    precise const vec3 second = base + odd.color / odd.weight;
    precise const vec3 d = shown(first) - shown(second);
    precise const float mean = precise_dot(d, d) / 3.0;
    return mean;
}

// The invocations beyond the frame's border take part in the block's sum, as the border pixel. A
// work group beyond the end of a work list does not.
bool takes_part(bool is_pixel, inout ivec2 pixel) {
    if (!is_pixel && all(lessThan(pixel, uniforms.size))) return false;
    pixel = min(pixel, uniforms.size - 1);
    return true;
}

void begin_block() {
    if (gl_LocalInvocationIndex == 0u) block_noise = 0u;
    barrier();
}

// After the first set: the second, whose weight grows with the block's noise. False if it is 0, and
// after the second.
bool next_set(inout SampleSet set, Pixel pixel, Sums sums, bool is_pixel) {
    if (set.first > 0) return false;
    const float noise = is_pixel ? noise_of(sums.even, sums.odd, sums.color.first.rgb) : 0.0;
    precise const float steps = kNoiseSteps * noise + 0.5;
    atomicAdd(block_noise, uint(steps));
    barrier();
    const ivec2 extent = min(uniforms.size - kBlockPx * pixel.block, ivec2(kBlockPx));
    const float mean = float(block_noise) / (kNoiseSteps * float(extent.x * extent.y));
    precise const float weight = clamp((mean / uniforms.noise_limit - 1.0) * kMoreWeight, 0.0, 1.0);
    if (weight == 0.0) return false;
    set = SampleSet(float(uniforms.more_samples), uniforms.samples, weight);
    return true;
}

// Standard deviation of the blur's noise, in that of the first set alone.
float noise_scale(SampleSet last) {
    const float more = last.first > 0 ? last.weight : 0.0;
    precise const float samples =
        1.0 + more * float(uniforms.more_samples) / float(uniforms.samples);
    return inversesqrt(samples);
}
#else
bool takes_part(bool is_pixel, ivec2 pixel) {
    return is_pixel;
}
void begin_block() {}
bool next_set(SampleSet set, Pixel pixel, Sums sums, bool is_pixel) {
    return false;
}
float noise_scale(SampleSet last) {
    return 1.0;
}
#endif
