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
    precise WideColor c;
    for (int i = 0; i < kPlanes; ++i) c.planes[i] = a.planes[i] - b.planes[i];
    return c;
}

// a + weight b
WideColor plus(WideColor a, float weight, WideColor b) {
    precise WideColor c;
    for (int i = 0; i < kPlanes; ++i) c.planes[i] = a.planes[i] + weight * b.planes[i];
    return c;
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

// By differences: equal texels give their value to the bit, and the first keeps its bits beside a
// brighter one if f is 0.
vec4 bilinear(vec4 texels[4], vec2 f) {
    precise const vec4 upper = texels[0] + f.x * (texels[1] - texels[0]);
    precise const vec4 lower = texels[2] + f.x * (texels[3] - texels[2]);
    precise const vec4 mean = upper + f.y * (lower - upper);
    return mean;
}

const float kSharpening = 2.0;  // of bilinear weights about their center: half the added blur

// Color of the surface that is seen at the position `at`, pixels: bilinear, with sharpened weights.
// Not by a sampler: devices round its weights to 8 bits.
WideColor color_at(WIDE_SAMPLER(color, layers), vec2 at) {
    precise const vec2 nearest = floor(at + 0.5);
    const vec2 beyond = at - nearest;
    precise const vec2 f = max(kSharpening * (abs(beyond) - 0.5) + 0.5, 0.0);
    const ivec2 a = ivec2(nearest);
    const ivec2 step = ivec2(mix(vec2(1.0), vec2(-1.0), lessThan(beyond, vec2(0.0))));
    const ivec2 b = min(a + step, uniforms.size - 1);
    const ivec2 corners[4] = ivec2[4](a, ivec2(b.x, a.y), ivec2(a.x, b.y), b);
    vec4 texels[4];
    WideColor c;
    for (int i = 0; i < 4; ++i) texels[i] = finite_color(texelFetch(color, corners[i], 0));
    c.planes[0] = bilinear(texels, f);
#ifdef LAYERS
    FOR_LAYERS(l) {
        for (int i = 0; i < 4; ++i) texels[i] = LAYER_FETCH(layers, corners[i], l);
        c.planes[1 + l] = bilinear(texels, f);
    }
#endif
    return c;
}
