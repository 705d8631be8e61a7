// What the samples of a pixel add up to, as differences to its own color.
vec4 own_color, sum = vec4(0.0);
#if DENOISE
Soft soft_sum = Soft(vec4(0.0), 0.0, vec3(0.0));
#endif
#if ADAPTIVE
Halves halves = Halves(vec3[2](vec3(0.0), vec3(0.0)), float[2](0.0, 0.0));
#endif
#ifdef LAYERS
vec4 own_layers[LAYERS], layer_sums[LAYERS];
#if DENOISE
vec4 soft_layers[LAYERS];
#endif
vec4 seen_layers[LAYERS];  // by the sample
#endif

// The pixel's own color and layers.
void begin_sums(ivec2 pixel) {
    own_color = texelFetch(color, pixel, 0);
#ifdef LAYERS
    FOR_LAYERS(l) {
        own_layers[l] = LAYER_FETCH(layers, pixel, l);
        layer_sums[l] = vec4(0.0);
#if DENOISE
        soft_layers[l] = vec4(0.0);
#endif
    }
#endif
}

// Sample k has seen this color, and seen_layers, of a surface with this inverse depth and path a.
void add_sample(int k, vec4 seen, float inverse_depth, vec2 path, float weight) {
    const vec4 difference = seen - own_color;
    sum += weight * difference;
#if ADAPTIVE
    add_to_half(halves, k, difference, weight);
#endif
#if DENOISE
    const bool is_soft = add_soft(soft_sum, difference, inverse_depth, path, weight);
#endif
#ifdef LAYERS
    FOR_LAYERS(l) {
        const vec4 added = weight * (seen_layers[l] - own_layers[l]);
        layer_sums[l] += added;
#if DENOISE
        if (is_soft) soft_layers[l] += added;
#endif
    }
#endif
}
