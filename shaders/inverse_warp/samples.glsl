// The samples of a pixel: their number, and the time sample and lens sample of each.
//
// NOISE: read    BARREL: the lens barrel cuts the aperture away from the center of the frame
#if NOISE
layout(binding = GATHER_NOISE) uniform sampler2D noise;
#endif
#if LENS
layout(binding = GATHER_LENS_SAMPLES) uniform sampler2D lens_samples;
#endif

// The number of samples, n. That of the shutter alone grows with the longest displacement. The last
// sample may be a part of one, so that nothing jumps where a longer path gets another sample.
float samples_of(Pixel pixel) {
    const float path_px = 2.0 * uniforms.time_scale * pixel.longest_px;
    const float times = clamp(path_px / uniforms.path_px_per_time,
                              float(INVERSE_WARP_MIN_TIMES),
                              float(max(uniforms.samples, INVERSE_WARP_MIN_TIMES)));
    return kLens ? float(uniforms.samples) : times;
}

// The pixel's random numbers: x in [0, 1), y in [-1, 1).
vec2 random_at(ivec2 pixel) {
#if NOISE
    return texelFetch(noise, pixel & 127, 0).xy;
#else
    return vec2(0.0);
#endif
}

// Time of sample k, in [-1, 1], or in the part of it in which the shutter is open. With a lens, whose
// samples go outward, times go by `order`: evenly spread, from the center of the shutter on, and turned by
// the random number.
float time_of(int k, float order, float n, float part, float random) {
    if (!kShutter) return 0.0;
    precise float u;
    if (kLens) {
        const float center = floor(0.5 * n) + 0.5;
        u = 2.0 * fract((order + center) / n + 0.5 * random) - 1.0;
    } else {
        u = 2.0 * (float(k) + 0.5 * part * (1.0 + uniforms.time_jitter * random)) / n - 1.0;
    }
    precise const float open_u = uniforms.time_shift + uniforms.time_scale * u;
    return open_u;
}

// Sample k of n. xy: in the unit disc, z: the order of its time (common/lens_samples.comp). With the
// shutter and kFewestTurned to kMostTurned samples, their inner half is turned by the other random number
// too: one turn for all leaves a hatch in lamps.
vec3 lens_sample(int k, float n, vec2 random) {
#if LENS
    const bool turned = kShutter && n >= kFewestTurned && n <= kMostTurned && k < int(n) / 2;
    precise const float turn = fract(random.x + (turned ? 0.5 * random.y : 0.0));
    const int table = clamp(int(turn * float(uniforms.lens_sets)), 0, uniforms.lens_sets - 1);
    return texelFetch(lens_samples, ivec2(k, table), 0).xyz;
#else
    return vec3(0.0);
#endif
}

Sample sample_at(int k, float n, Pixel pixel) {
    // The number of samples with a lens is whole.
    precise const float part = kLens ? 1.0 : min(n - float(k), 1.0);
    const vec3 point = lens_sample(k, n, pixel.random);
    Sample at;
    at.u = time_of(k, point.z, n, part, pixel.random.y);
    at.bend = bend_at(at.u);
    at.lens = point.xy;
    at.weight = part;
    // Another ratio for each sample: while two surfaces pass each other in depth, their samples
    // change over one by one.
    precise const float golden = fract(pixel.random.x + 0.618034 * float(k));
    at.depth_ratio = precise_mix(kMinDepthRatio, kMaxDepthRatio, golden);
    return at;
}

// Does the light that reaches the pixel through this lens sample pass the barrel? The barrel's
// circle moves across the aperture with the distance from the center of the frame.
bool passes_barrel(Pixel pixel, Sample now) {
#if BARREL
    const vec2 center = vec2(uniforms.center_x, uniforms.center_y);
    const vec2 barrel = uniforms.barrel_per_px * (pixel.p - center);
    const vec2 axes = vec2(uniforms.pixel_axis_x, uniforms.pixel_axis_y);
    precise const vec2 passed = (uniforms.barrel_scale * now.lens + barrel) / axes;
    return !(precise_dot(passed, passed) > 1.0);
#else
    return true;
#endif
}
