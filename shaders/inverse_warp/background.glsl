// What is hidden behind nearer surfaces, from the cells that background.comp has made.
layout(binding = 11) uniform sampler2D background_color;
layout(binding = 12) uniform sampler2D background_depth;
#ifdef LAYERS
layout(binding = 14) uniform sampler2DArray background_layers;
#endif

// The color at `at`, pixels, of a surface of this inverse depth or a smaller one: bilinear between
// the smallest cells around that have some. `otherwise`: where none has. Layers are filled with what
// the same cells have of them; as they come in, they stand for what is seen where none has.
#ifdef LAYERS
vec4 background_at(vec2 at, float inverse_depth, vec4 otherwise, inout vec4 seen_layers[LAYERS]) {
    vec4 first_layers[LAYERS], layer_sums[LAYERS];
    FOR_LAYERS(l) {
        first_layers[l] = vec4(0.0);
        layer_sums[l] = vec4(0.0);
    }
#else
vec4 background_at(vec2 at, float inverse_depth, vec4 otherwise) {
#endif
    ivec2 cells = 8 * uniforms.tiles;
    int left = 0;
    vec2 place = 0.5 * (at + 0.5) - 0.5;
    do {
        const vec2 base = floor(place);
        const vec2 f = place - base;
        vec4 first = otherwise, sum = vec4(0.0);
        float total = 0.0;
        for (int i = 0; i < 4; ++i) {
            const vec2 corner = vec2(i & 1, i >> 1);
            ivec2 cell = clamp(ivec2(base + corner), ivec2(0), cells - 1);
            cell.x += left;
            const vec2 depth_part = texelFetch(background_depth, cell, 0).xy;
            const vec2 w = mix(1.0 - f, f, corner);
            const float weight = w.x * w.y * depth_part.y;
            if (weight == 0.0 || depth_part.x > kOneDepth * inverse_depth) continue;
            const vec4 c = texelFetch(background_color, cell, 0);
#ifdef LAYERS
            FOR_LAYERS(l) {
                const vec4 layer = LAYER_FETCH(background_layers, cell, l);
                if (total == 0.0) first_layers[l] = layer;
                layer_sums[l] += weight * (layer - first_layers[l]);
            }
#endif
            if (total == 0.0) first = c;
            sum += weight * (c - first);
            total += weight;
        }
#ifdef LAYERS
        if (total > 0.0) FOR_LAYERS(l) seen_layers[l] = first_layers[l] + layer_sums[l] / total;
#endif
        if (total > 0.0) return first + sum / total;
        left += cells.x;
        cells /= 2;
        place = 0.5 * place - 0.25;
    } while (cells.x >= uniforms.tiles.x);
    return otherwise;
}
