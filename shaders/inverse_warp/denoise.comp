#version 450 core
// Less noise from few samples. What a pixel's samples see out of focus, or on fast surfaces, is a mean
// over the spread of their displacements, and holds no detail much finer than that. So its mean is
// taken over the pixels around too, within a small part of that spread: the more samples, the smaller.
// What is sharp is left alone.
//
//   gathered, soft (rgb: mean of what blurred samples have seen; a: share of such samples),
//   spread (their displacements' mean covariance: xx, xy, yy, px^2; mean of their alpha) -> color
//
// LAYERS: so many further layers too, of layers_gathered and layers_soft
// LIST: only the blocks of a work list
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_list.glsl"
#include "shared/inverse_warp_uniforms.h"

layout(binding = 0) uniform sampler2D gathered;
layout(binding = 1) uniform sampler2D soft;
layout(binding = 2) uniform sampler2D spread;
layout(binding = 0) writeonly uniform image2D denoised;
#ifdef LAYERS
layout(binding = 3) uniform sampler2DArray layers_gathered;
layout(binding = 4) uniform sampler2DArray layers_soft;
layout(binding = 1) writeonly uniform image2DArray layers_denoised;
#endif

const int kReachPx = INVERSE_WARP_DENOISE_REACH_PX;
const float kLeast = 1.0 / 64.0;  // taken off every weight: the window ends without a step
const float kPixel = 1.0 / 12.0;  // px^2, of a pixel itself

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
    const vec4 own = texelFetch(gathered, p, 0);
    const vec4 own_soft = texelFetch(soft, p, 0);
    if (own_soft.a == 0.0 || !is_finite(own)) {
        STORE(denoised, p, own);
#ifdef LAYERS
        FOR_LAYERS(i) LAYER_STORE(layers_denoised, p, i, LAYER_FETCH(layers_gathered, p, i));
#endif
        return;
    }
    const vec4 own_spread = texelFetch(spread, p, 0);
    const float xx = own_spread.x + kPixel, xy = own_spread.y, yy = own_spread.z + kPixel;
    const float scale = -uniforms.denoise_window / (xx * yy - xy * xy);
    const ivec2 reach =
        min(ivec2(sqrt(log(1.0 / kLeast) / uniforms.denoise_window * vec2(xx, yy))), kReachPx);
    const ivec2 least = max(p - reach, ivec2(0)), most = min(p + reach, uniforms.size - 1);
    vec4 sum = vec4(0.0);
    float total = 0.0;
#ifdef LAYERS
    vec4 own_layers[LAYERS], layer_sums[LAYERS];
    FOR_LAYERS(i) {
        own_layers[i] = LAYER_FETCH(layers_soft, p, i);
        layer_sums[i] = vec4(0.0);
    }
#endif
    for (int y = least.y; y <= most.y; ++y) {
        for (int x = least.x; x <= most.x; ++x) {
            const vec4 around = texelFetch(soft, ivec2(x, y), 0);
            if (around.a == 0.0) continue;
            const vec2 d = vec2(ivec2(x, y) - p);
            const float form = yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y;
            const float weight = around.a * max(exp(scale * form) - kLeast, 0.0);
            const float alpha = texelFetch(spread, ivec2(x, y), 0).w;
            sum += weight * (vec4(around.rgb, alpha) - vec4(own_soft.rgb, own_spread.w));
#ifdef LAYERS
            FOR_LAYERS(i)
                layer_sums[i] +=
                    weight * (LAYER_FETCH(layers_soft, ivec2(x, y), i) - own_layers[i]);
#endif
            total += weight;
        }
    }
    STORE(denoised, p, own + own_soft.a / total * sum);
#ifdef LAYERS
    FOR_LAYERS(i)
        LAYER_STORE(layers_denoised, p, i,
                    LAYER_FETCH(layers_gathered, p, i) + own_soft.a / total * layer_sums[i]);
#endif
}
