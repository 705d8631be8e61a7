// The samples of a pixel: how many, and which instant and point of the lens each of them takes.
#if LENS
layout(binding = 4) uniform sampler2D lens_points;
#endif

// Inverse depths within a ratio of at most so much: the smaller residual counts.
const float kOneDepthLeast = 1.01, kOneDepthMost = 1.03;

// How many samples a pixel takes. The last may be part of one, so that nothing jumps where a longer
// path gets a time more.
float samples_of(float longest) {
#if LENS
    return float(uniforms.samples);
#else
    return clamp(2.0 * longest / uniforms.path_px_per_time, float(INVERSE_WARP_LEAST_TIMES),
                 float(max(uniforms.samples, INVERSE_WARP_LEAST_TIMES)));
#endif
}

// Sample k of a set of n, whose points of the lens begin at `begin` and whose weights are `share` of
// others'. random: x in [0, 1), y in [-1, 1)
Sample sample_at(int k, float n, int begin, float share, vec2 random) {
    Sample at;
    const float part = min(n - float(k), 1.0);
    at.weight = share * part;
#if SHUTTER && LENS
    const float place = float(bitfieldReverse(uint(k)) >> 8) / 16777216.0;
    at.u = 2.0 * fract(place + 0.5 / n + 0.5 + 0.5 * random.y) - 1.0;
#elif SHUTTER
    at.u = 2.0 * (float(k) + 0.5 * part * (1.0 + uniforms.time_jitter * random.y)) / n - 1.0;
#else
    at.u = 0.0;
#endif
    at.bend = bend_at(at.u);
#if LENS
    const int set = min(int(random.x * float(uniforms.lens_sets)), uniforms.lens_sets - 1);
    at.lens = texelFetch(lens_points, ivec2(begin + k, set), 0).xy;
#else
    at.lens = vec2(0.0);
#endif
    return at;
}

// The ratio of inverse depths beyond which the nearer surface counts, another for each sample: while
// two surfaces pass each other in depth, their samples change over one by one.
float one_depth_at(int k, vec2 random) {
    return mix(kOneDepthLeast, kOneDepthMost, fract(random.x + 0.618034 * float(k)));
}
