#version 450 core
// Takes away the noise of few samples. The samples of a pixel that see surfaces out of focus, or
// fast ones, are a mean over the spread of their displacements, which holds no detail much finer
// than that spread. So their mean is also taken over the pixels around, within a small part of the
// spread: the more samples, the smaller. Sharp surfaces are left alone.
//
//   color, soft (rgb: mean color of blurred samples; a: their share), spread (Cholesky factor of
//   the mean covariance of their displacements, px; mean of their alpha) -> color, in place
//
// LAYERS: defined if the frame has extra layers: layers, layers_soft, and the bits of those that are
// not 0 in a pixel, `reached` (taps.glsl)
// LIST: only the blocks of a work list
//
// A GPU keeps the blurred samples of a block, and of the pixels around it, in the work group's memory: 25
// pixels read each.
#include "common/software_loop.glsl"
#include "common/work_list.glsl"

#include "inverse_warp/wide_color.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D soft;
layout(binding = 2) uniform sampler2D spread;
layout(binding = 0) writeonly uniform image2D denoised;
#ifdef LAYERS
layout(binding = 3) uniform sampler2DArray layers;
layout(binding = 4) uniform sampler2DArray layers_soft;
layout(binding = 5) uniform usampler2DArray reached;
layout(binding = 1) writeonly uniform image2DArray layers_denoised;

#include "inverse_warp/layer_bits.glsl"
#endif

const int kReachPx = INVERSE_WARP_DENOISE_REACH_PX;

// Weights exp(-denoise_window |L^-1 d|^2) of the pixels within `reach`.
struct Window {
    vec2 narrow;  // 1/l11, 1/l22: 1/px
    float slant;  // l21, px
    ivec2 reach;
};

Window window_of(vec3 factor) {
    precise Window w;
    w.narrow = 1.0 / factor.xz;
    w.slant = factor.y;
    precise const vec2 deviation =
        vec2(factor.x, sqrt(factor.y * factor.y + factor.z * factor.z));
    w.reach =
        min(ivec2(sqrt(log(1.0 / kLeastWeight) / uniforms.denoise_window) * deviation), kReachPx);
    return w;
}

float weight_at(Window w, vec2 d) {
    precise const float u = w.narrow.x * d.x;
    precise const float v = w.narrow.y * (d.y - w.slant * u);
    precise const float weight =
        max(exp(-uniforms.denoise_window * (u * u + v * v)) - kLeastWeight, 0.0);
    return weight;
}

#ifdef SOFTWARE_RENDERER
bool load_soft(ivec2 block_px, float own_share) {
    return true;
}

// The share of the blurred samples of pixel p, and their mean color.
float share_at(ivec2 p) {
    return texelFetch(soft, p, 0).a;
}

vec4 soft_color_at(ivec2 p, Plane plane) {
    vec4 c = fetch(WIDE(soft, layers_soft), plane, p);
    if (plane.is_color) c.a = texelFetch(spread, p, 0).w;
    return c;
}
#else
const int kTileEdge = kBlockPx + 2 * kReachPx, kThreads = kBlockPx * kBlockPx;
shared vec4 soft_tile[kTileEdge * kTileEdge];  // rgb: mean color, a: share
shared float alpha_tile[kTileEdge * kTileEdge];
shared ivec2 tile_at;
shared uint blurred;  // not 0: a pixel of the block has blurred samples

// Loads the tile of the block at this pixel, if some pixel needs it. The work group calls it together.
bool load_soft(ivec2 block_px, float own_share) {
    const int thread = int(gl_LocalInvocationIndex);
    if (thread == 0) {
        blurred = 0u;
        tile_at = block_px - kReachPx;
    }
    barrier();
    if (own_share != 0.0) atomicOr(blurred, 1u);
    barrier();
    if (blurred == 0u) return false;
    for (int i = thread; i < kTileEdge * kTileEdge; i += kThreads) {
        const ivec2 p = clamp(tile_at + ivec2(i % kTileEdge, i / kTileEdge), ivec2(0),
                              uniforms.size - 1);
        const vec4 stored = texelFetch(soft, p, 0);
        soft_tile[i] = vec4(finite_color(stored).rgb, stored.a);
        alpha_tile[i] = stored.a != 0.0 ? texelFetch(spread, p, 0).w : 0.0;
    }
    barrier();
    return true;
}

int place_in_tile(ivec2 p) {
    const ivec2 place = p - tile_at;
    return place.y * kTileEdge + place.x;
}

float share_at(ivec2 p) {
    return soft_tile[place_in_tile(p)].a;
}

vec4 soft_color_at(ivec2 p, Plane plane) {
#ifdef LAYERS
    if (!plane.is_color) return texelFetch(layers_soft, ivec3(p, plane.layer), 0);
#endif
    return vec4(soft_tile[place_in_tile(p)].rgb, alpha_tile[place_in_tile(p)]);
}
#endif

// The pixels that are denoised together with pixel p.
struct Around {
    ivec2 p, first, last;
    Window window;
    float share;
};

Around around(ivec2 p, float share) {
    const Window window = window_of(texelFetch(spread, p, 0).xyz);
    return Around(p, max(p - window.reach, ivec2(0)), min(p + window.reach, uniforms.size - 1),
                  window, share);
}

// The colors around pixel p, less its own, with their weights.
struct SoftMean {
    vec4 sum;
    float total;
};

void add(precise inout SoftMean mean, Around a, ivec2 at, Plane plane, vec4 own) {
    const float share = share_at(at);
    if (share == 0.0) return;
    const float weight = share * weight_at(a.window, vec2(at - a.p));
    mean.sum += weight * (soft_color_at(at, plane) - own);
    mean.total += weight;
}

vec4 denoised_color(Around a, Plane plane) {
    const vec4 own = soft_color_at(a.p, plane);
    SoftMean soft_mean = SoftMean(vec4(0.0), 0.0);
#ifdef SOFTWARE_RENDERER
    ivec2 at = a.first;
    SOFTWARE_LOOP do {
        add(soft_mean, a, at, plane, own);
        at = at.x < a.last.x ? at + ivec2(1, 0) : ivec2(a.first.x, at.y + 1);
    } while (at.y <= a.last.y);
#else
    for (int y = a.first.y; y <= a.last.y; ++y)
        for (int x = a.first.x; x <= a.last.x; ++x) add(soft_mean, a, ivec2(x, y), plane, own);
#endif
    precise const vec4 mean =
        fetch(WIDE(color, layers), plane, a.p) + a.share / soft_mean.total * soft_mean.sum;
    return mean;
}

#ifdef LAYERS
uint reached_around(Around a, int word) {
    uint bits = texelFetch(reached, ivec3(a.p, word), 0).x;
    for (int y = a.first.y; y <= a.last.y; ++y)
        for (int x = a.first.x; x <= a.last.x; ++x)
            if (share_at(ivec2(x, y)) != 0.0)
                bits |= texelFetch(reached, ivec3(x, y, word), 0).x;
    return bits;
}

void store_denoised_layers(Around a) {
    for (int word = 0; word < words_of(layers); ++word) {
        // A layer that is 0 around the pixel stays 0.
        uint bits = reached_around(a, word) & bits_of_word(layers, word);
        while (bits != 0u) {
            const int l = next_layer(bits, word);
            imageStore(layers_denoised, ivec3(a.p, l), denoised_color(a, Plane(false, l)));
        }
    }
}
#else
void store_denoised_layers(Around a) {}
#endif

void main() {
    ivec2 p;
    const float own_share = next_pixel(uniforms.size, p) ? texelFetch(soft, p, 0).a : 0.0;
    if (!load_soft(kBlockPx * (p / kBlockPx), own_share) || own_share == 0.0) return;
    const Around a = around(p, own_share);
    imageStore(denoised, p, denoised_color(a, kColor));
    store_denoised_layers(a);
}
