#version 450 core
// Layers that a pass filters beside color if objects are held out of it (docs/layers.md).
//
//   color, mattes [, layers] -> held: color without the object; what part of the pixel is not the
//                               object, in x; the frame's own layers without it
//
// MATTE: index of the pass's matte    LAYERS: defined if the frame has layers, however many
#include "common/finite.glsl"
#include "common/matte.glsl"
#include "common/precise.glsl"
#include "common/work_group.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2DArray mattes;
#ifdef LAYERS
layout(binding = 2) uniform sampler2DArray layers;
#endif
layout(binding = 0) writeonly uniform image2DArray held;

// A soft pixel shows both, c = m F + (1 - m) G. The ground G is taken from the pixels around, almost
// only from pixels without the object. The pixel's own color counts as its matte goes to 0, and if
// no ground is near. It also counts where pixels around are too bright to be behind this one: as
// much as makes (1 - m) G at most c, channel by channel, so that no object has light below 0.
const int kAround = 2, kWindow = 2 * kAround + 1;
const float kSpread = 1.25;            // px, deviation of a Gaussian
const float kOwn = 1.0 / 16.0, kMinWeight = 1.0 / 16.0;

float weights[kWindow * kWindow];

// (1 - m)^16
float beside(float m) {
    precise const float kept = 1.0 - m;
    const float second = kept * kept, fourth = second * second;
    return (fourth * fourth) * (fourth * fourth);
}

void find_weights(ivec2 p, float m) {
    precise float total = 0.0;
    for (int j = -kAround; j <= kAround; ++j)
        for (int i = -kAround; i <= kAround; ++i) {
            const ivec2 at = p + ivec2(i, j);
            const int index = (j + kAround) * kWindow + i + kAround;
            weights[index] = 0.0;
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, uniforms.size))) continue;
            const float near = exp(-float(i * i + j * j) / (2.0 * kSpread * kSpread));
            weights[index] = i == 0 && j == 0 ? kOwn * beside(m) / m : near * beside(matte_at(at));
            total += weights[index];
        }
    precise const float own = weights[kAround * kWindow + kAround] + max(kMinWeight - total, 0.0);
    weights[kAround * kWindow + kAround] = own;
    total = max(total, kMinWeight);
    for (int i = 0; i < kWindow * kWindow; ++i) weights[i] /= total;
}

// The ground of a soft pixel; `fetch(p)` reads the plane.
#define GROUND(ground, fetch)                                                     \
    precise vec4 ground = vec4(0.0);                                                   \
    for (int i = 0; i < kWindow * kWindow; ++i)                                   \
        if (weights[i] > 0.0)                                                     \
            ground += weights[i] * fetch(p + ivec2(i % kWindow, i / kWindow) - kAround);

// The share of the pixel's own color c in its ground.
vec4 own_share(vec4 c, vec4 ground, float kept) {
    precise const vec4 own = (kept * ground - c) / max(kept * (ground - c), 1e-30);
    return clamp(own, 0.0, 1.0);
}

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    const float m = matte_at(p);
    precise const float kept = 1.0 - m;
    const bool soft = m > 0.0 && m < 1.0;
    if (soft) find_weights(p, m);
#define FETCH_COLOR(at) finite_color(texelFetch(color, at, 0))
    vec4 c = FETCH_COLOR(p);
    vec4 own = vec4(0.0);
    if (soft) {
        GROUND(ground, FETCH_COLOR)
        own = own_share(c, ground, kept);
        c = precise_mix(ground, c, own);
    }
    imageStore(held, ivec3(p, 0), without(c, kept));
    imageStore(held, ivec3(p, 1), vec4(kept, 0.0, 0.0, 0.0));
#ifdef LAYERS
    for (int l = 0; l < textureSize(layers, 0).z; ++l) {
#define FETCH_LAYER(at) texelFetch(layers, ivec3(at, l), 0)
        vec4 layer = FETCH_LAYER(p);
        if (soft) {
            GROUND(ground, FETCH_LAYER)
            layer = precise_mix(ground, layer, own);
        }
        imageStore(held, ivec3(p, l + 2), without(layer, kept));
    }
#endif
}
