#version 450 core
// Box mean over FACTOR x FACTOR pixels from the top left; out-of-bounds pixels do not count.
// HDR_WEIGHT: a pixel weighs 1/(1 + max(rgb, 0)), so that a small highlight does not flicker as it
// crosses boxes. LAYERS: number of extra layers, averaged with the weights of color.
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_list.glsl"
#include "shared/depth_of_field_uniforms.h"
#include "depth_of_field/storable.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D small;
#ifdef LAYERS
layout(binding = 1) uniform sampler2DArray layers;
layout(binding = 1) writeonly uniform image2DArray small_layers;
#endif

void main() {
    ivec2 low;
    if (!next_pixel(uniforms.low_size, low)) return;
    ivec2 first = low * FACTOR;
    ivec2 end = min(first + FACTOR, uniforms.size);

    // Equal colors return unrounded.
    vec4 first_color = vec4(0.0);
    bool all_equal = true;
    precise vec4 sum = vec4(0.0);
    precise float total = 0.0;
#ifdef LAYERS
    vec4 first_layers[LAYERS];
    precise vec4 layer_sums[LAYERS];
    bool layer_equal[LAYERS];
    FOR_LAYERS(i) {
        first_layers[i] = vec4(0.0);
        layer_sums[i] = vec4(0.0);
        layer_equal[i] = true;
    }
#endif
    for (int y = first.y; y < end.y; ++y) {
        for (int x = first.x; x < end.x; ++x) {
            const vec4 c = finite_color(texelFetch(color, ivec2(x, y), 0));
            if (total == 0.0) first_color = c;
            all_equal = all_equal && c == first_color;
#ifdef HDR_WEIGHT
            float weight = 1.0 / (1.0 + max(max(c.r, max(c.g, c.b)), 0.0));
#else
            float weight = 1.0;
#endif
#ifdef LAYERS
            FOR_LAYERS(i) {
                const vec4 layer = LAYER_FETCH(layers, ivec2(x, y), i);
                if (total == 0.0) first_layers[i] = layer;
                layer_equal[i] = layer_equal[i] && layer == first_layers[i];
                layer_sums[i] += weight * layer;
            }
#endif
            sum += weight * c;
            total += weight;
        }
    }
    STORE(small, low, storable(all_equal ? first_color : sum / total));
#ifdef LAYERS
    FOR_LAYERS(i)
        LAYER_STORE(small_layers, low, i,
                    storable(layer_equal[i] ? first_layers[i] : layer_sums[i] / total));
#endif
}
