#version 450 core
// Takes away the noise of few samples. The samples of a pixel that see surfaces out of focus, or
// fast ones, are a mean over the spread of their displacements, which holds no detail much finer
// than that spread. So their mean is also taken over the pixels around, within a small part of the
// spread: the more samples, the smaller. Sharp surfaces are left alone.
//
//   gathered, soft (rgb: mean color of blurred samples; a: their share), spread (mean covariance of
//   their displacements: xx, xy, yy, px^2; mean of their alpha) -> color
//
// LAYERS: number of extra layers, of layers_gathered and layers_soft
// LIST: only the blocks of a work list
#include "common/work_list.glsl"

#include "inverse_warp/wide_color.glsl"

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
const float kMinWeight = 1.0 / 64.0;      // taken off every weight: the window ends without a step
const float kPixelVariance = 1.0 / 12.0;  // px^2

// Weights exp(scale (yy dx^2 - 2 xy dx dy + xx dy^2)) of the pixels within `reach`.
struct Window {
    float xx, xy, yy;  // covariance, px^2
    float scale;
    ivec2 reach;
};

Window window_of(vec3 covariance) {
    precise Window w;
    w.xx = covariance.x + kPixelVariance;
    w.xy = covariance.y;
    w.yy = covariance.z + kPixelVariance;
    w.scale = -uniforms.denoise_window / (w.xx * w.yy - w.xy * w.xy);
    w.reach = min(ivec2(sqrt(log(1.0 / kMinWeight) / uniforms.denoise_window * vec2(w.xx, w.yy))),
                  kReachPx);
    return w;
}

float weight_at(Window w, vec2 d) {
    precise const float form = w.yy * d.x * d.x - 2.0 * w.xy * d.x * d.y + w.xx * d.y * d.y;
    precise const float weight = max(exp(w.scale * form) - kMinWeight, 0.0);
    return weight;
}

// Mean color of the blurred samples of pixel p.
WideColor soft_color_at(ivec2 p) {
    WideColor c = fetch(WIDE(soft, layers_soft), p);
    c.planes[0].a = texelFetch(spread, p, 0).w;
    return c;
}

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
    const WideColor own = fetch(WIDE(gathered, layers_gathered), p);
    const float own_share = texelFetch(soft, p, 0).a;
    if (own_share == 0.0) {
        STORE_WIDE(denoised, layers_denoised, p, own);
        return;
    }
    const Window window = window_of(texelFetch(spread, p, 0).xyz);
    const ivec2 first = max(p - window.reach, ivec2(0));
    const ivec2 last = min(p + window.reach, uniforms.size - 1);
    const WideColor own_soft = soft_color_at(p);
    WideColor sum = no_color();
    precise float total = 0.0;
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            const float share = texelFetch(soft, ivec2(x, y), 0).a;
            if (share == 0.0) continue;
            const float weight = share * weight_at(window, vec2(ivec2(x, y) - p));
            sum = plus(sum, weight, minus(soft_color_at(ivec2(x, y)), own_soft));
            total += weight;
        }
    }
    const WideColor mean = plus(own, own_share / total, sum);
    STORE_WIDE(denoised, layers_denoised, p, mean);
}
