// A wide color: RGBA, then the extra layers that this step filters with it (common/layers.glsl).
// Layers get the weights of the color. A wide texture is a texture and the array of its layers.
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "shared/inverse_warp_uniforms.h"

#ifdef LAYERS
const int kPlanes = 1 + LAYERS;
#define WIDE(color, layers) color, layers
#define WIDE_SAMPLER(color, layers) sampler2D color, sampler2DArray layers
#define STORE_WIDE(image, images, at, wide)  \
    STORE(image, at, (wide).planes[0]);      \
    FOR_LAYERS(l) LAYER_STORE(images, at, l, (wide).planes[1 + l])
#else
const int kPlanes = 1;
#define WIDE(color, layers) color
#define WIDE_SAMPLER(color, layers) sampler2D color
#define STORE_WIDE(image, images, at, wide) STORE(image, at, (wide).planes[0])
#endif

struct WideColor {
    vec4 planes[kPlanes];  // the color first
};

WideColor no_color() {
    WideColor c;
    for (int i = 0; i < kPlanes; ++i) c.planes[i] = vec4(0.0);
    return c;
}

WideColor minus(WideColor a, WideColor b) {
    for (int i = 0; i < kPlanes; ++i) a.planes[i] -= b.planes[i];
    return a;
}

// a + weight b
WideColor plus(WideColor a, float weight, WideColor b) {
    for (int i = 0; i < kPlanes; ++i) a.planes[i] += weight * b.planes[i];
    return a;
}

WideColor divided(WideColor a, float divisor) {
    for (int i = 0; i < kPlanes; ++i) a.planes[i] /= divisor;
    return a;
}

WideColor fetch(WIDE_SAMPLER(color, layers), ivec2 at) {
    WideColor c;
    c.planes[0] = finite_color(texelFetch(color, at, 0));
#ifdef LAYERS
    FOR_LAYERS(l) c.planes[1 + l] = LAYER_FETCH(layers, at, l);
#endif
    return c;
}

const float kSharpening = 2.0;  // of bilinear weights about their center: half the added blur

// Color of the surface that is seen at the position `at`, pixels: bilinear, with sharpened weights.
WideColor color_at(WIDE_SAMPLER(color, layers), vec2 at) {
    const vec2 base = floor(at);
    const vec2 f = clamp(kSharpening * (at - base - 0.5) + 0.5, 0.0, 1.0);
    const vec2 filtered_at = (base + f + 0.5) / vec2(uniforms.size);
    WideColor c;
    c.planes[0] = textureLod(color, filtered_at, 0.0);
    // The sampler may have mixed a value that passes do not read: then by hand.
    if (!is_readable(c.planes[0])) {
        c = no_color();
        int i = 0;
        do {
            const vec2 corner = vec2(i & 1, i >> 1);
            const ivec2 p = min(ivec2(base + corner), uniforms.size - 1);
            const vec2 w = mix(1.0 - f, f, corner);
            c = plus(c, w.x * w.y, fetch(WIDE(color, layers), p));
            ++i;
        } while (i < 4);
        return c;
    }
#ifdef LAYERS
    FOR_LAYERS(l)
        c.planes[1 + l] = textureLod(layers, vec3(filtered_at, float(LAYERS_FIRST + l)), 0.0);
#endif
    return c;
}
