#version 450 core
// Averages, over time samples and lens samples, the color of the surface seen at pixel p. Each
// sample searches by fixed-point iteration, X <- p - D(X) (Yang et al., Image-Based Bidirectional
// Scene Reprojection, 2011; Bowles et al., Iterative Image Warping, 2012), from the pixel, then
// from the block's start surfaces, nearest first. X is accepted if X + D(X) is within kAcceptPx of
// p; the nearest accepted surface wins. If none is accepted, or a start surface may be occluded
// here, neighboring frames are searched. If nothing is found anywhere, the farthest surface visited
// is extended behind its occluder.
//
//   color, surfaces, starts, background_color, background [, lens_samples] [, noise] [, hint]
//       -> color [, soft, spread] [, hint]
//   color, surfaces of the frames before and after; the layer behind
//
//   block_starts.glsl                    the start surfaces of the pixel's block
//   samples.glsl                         time samples and lens samples
//   search.glsl            Search        the search for one sample's surface in this frame
//   deferred_samples.glsl                the samples that it does not settle
//   second_layer.glsl                    the search for an occluded surface in the layer behind
//   background.glsl                      the fill of surfaces that no frame shows
//   neighbors.glsl         Found         the search for an occluded surface in the frames before and after
//   continuation.glsl      Continuation  the occluded surfaces that continue behind their occluder
//   source.glsl            Source        where a sample's color comes from
//   mean.glsl              Mean          of samples
//   taps.glsl              Tap           the extra layers, from the samples of color
//   accumulate.glsl        Hit, Sums     one sample's color; the sums over a pixel's samples
//   small_circles.glsl     Circle        small circles of confusion, summed without samples
//
// SHUTTER, LENS: which of the two are open    STARTS: room for a block's start surfaces
// BEFORE, AFTER: that frame is searched       NOISE: noise is read
// BARREL: the lens barrel cuts the aperture away from the center of the frame
// DENOISE: the mean of blurred samples goes to `soft` and `spread`, for denoise.comp
// LAYERS: defined if the frame has extra layers, also those of the background and the neighbors
// TAPS: with LAYERS: room for a pixel's samples    FILL_LAYER: a layer is the fill mask
// HINT: written; of the lens alone: also read    LIST: only the blocks of a work list
#include "common/software_loop.glsl"
#include "common/work_list.glsl"

#include "inverse_warp/cells.glsl"
#include "inverse_warp/surface.glsl"
#include "inverse_warp/wide_color.glsl"

#include "inverse_warp/mixture.glsl"
#include "shared/inverse_warp_gather_units.h"

layout(binding = GATHER_COLOR) uniform sampler2D color;
layout(binding = GATHER_SURFACES) uniform usampler2D surfaces;
layout(binding = GATHER_STARTS) uniform usampler2D starts;
layout(binding = GATHER_BACKGROUND_COLOR) uniform sampler2D background_color;
layout(binding = GATHER_BACKGROUND) uniform sampler2D background;
layout(binding = GATHER_BLURRED_IMAGE) writeonly uniform image2D blurred;
#if DENOISE
layout(binding = GATHER_SOFT_IMAGE) writeonly uniform image2D soft;
layout(binding = GATHER_SPREAD_IMAGE) writeonly uniform image2D spread;
#endif
#if HINT && !SHUTTER
layout(binding = GATHER_GIVEN_HINT) uniform sampler2D given_hint;
#endif
#if HINT
layout(binding = GATHER_HINT_IMAGE) writeonly uniform image2D hint;
#endif
#ifdef LAYERS
layout(binding = GATHER_LAYERS) uniform sampler2DArray layers;
layout(binding = GATHER_BACKGROUND_LAYERS) uniform sampler2DArray background_layers;
#endif

// Shared by all samples of a pixel.
struct Pixel {
    vec2 p;
    ivec2 at;   // the same
    uvec4 own;  // the pixel's own surface
    vec2 random;
    ivec2 block;
    float longest_px;      // longest displacement that reaches the block
    int start_count;
};

vec4 color_beside(Pixel pixel, uint place, Plane plane) {
    return fetch(WIDE(color, layers), plane, ivec2(beside(pixel.p, place)));
}

// Lays the surface in front over the mean, by its part. `held`: the pixel's color with the surface behind
// replaced by the one in front.
vec4 with_front_over(Pixel pixel, Plane plane, vec4 mean) {
    const float part = front_part(pixel.own);
    if (part == 0.0) return mean;
    const vec4 front = color_beside(pixel, front_in(pixel.own), plane);
    const vec4 back = color_beside(pixel, place_in(pixel.own), plane);
    precise const vec4 held = color_beside(pixel, kOwnPlace, plane) + (1.0 - part) * (front - back);
    precise const vec4 both = mean + part * (held - mean);
    return both;
}

#include "inverse_warp/block_starts.glsl"
#include "inverse_warp/samples.glsl"
#include "inverse_warp/search.glsl"
#include "inverse_warp/second_layer.glsl"
#include "inverse_warp/deferred_samples.glsl"
#include "inverse_warp/background.glsl"
#include "inverse_warp/neighbors.glsl"
#include "inverse_warp/continuation.glsl"
#include "inverse_warp/source.glsl"
#include "inverse_warp/mean.glsl"
#include "inverse_warp/taps.glsl"
#include "inverse_warp/accumulate.glsl"
#include "inverse_warp/small_circles.glsl"

Pixel pixel_at(ivec2 at) {
    Pixel pixel;
    pixel.p = vec2(at);
    pixel.at = at;
    pixel.own = texelFetch(surfaces, at, 0);
    pixel.random = random_at(at);
    pixel.block = at / kBlockPx;
    const uvec4 summary = start_texel(pixel.block, uniforms.starts);
    pixel.longest_px = uintBitsToFloat(summary.x);
    pixel.start_count = int(min(summary.y, uint(STARTS)));
    return pixel;
}

// Fetched where it is needed: a GPU would hold it in four registers until then.
vec4 own_color(Pixel pixel) {
    return fetch(WIDE(color, layers), kColor, pixel.at);
}

// On a surface that a frame shows; `at`: where this frame shows or hides it.
Hit hit_of(Found found, vec2 at) {
    return Hit(Source(found.frame, found.at, uvec2(0u), found.beyond), found.inverse_depth,
                found.path, at);
}

// A sample sees the nearest surface found in any frame or known to continue behind the one that
// this frame shows, otherwise the fill.
Hit resolve(Pixel pixel, Sample now, Search here) {
    const bool shown = here.nearest.inverse_depth >= 0.0;
    precise const vec2 far_at = pixel.p - displacement(here.far, now);
    const vec2 far = inside_of(far_at);
    const vec2 at = shown ? here.nearest.at : far;
    Found found = resolve_second_layer(pixel, now, here);
    if (kNeighbors) found = resolve_occluded(pixel, now, here, found);
    // In another light, a fill that shows the surface errs less.
    if (kNeighbors && !shown && found.other_light)
        if (is_filled(found, here.far, far)) found.inverse_depth = -1.0;
    if (kNeighbors && kLens && shows_beside(found, here.far, far)) found.inverse_depth = -1.0;
    const Continuation continued = find_continuation(pixel, now, here, found.inverse_depth);
    if (continued.inverse_depth >= 0.0)
        return Hit(Source(kContinuation, continued.at, continued.sides, false),
                   continued.inverse_depth, continued.path, continued.at);
    if (found.inverse_depth >= 0.0) return hit_of(found, at);
    const uvec2 farthest =
        uvec2(floatBitsToUint(here.far.inverse_depth), pack_cell(ivec2(here.far_at)));
    return Hit(Source(kFill, far, farthest, false), here.far.inverse_depth, here.far.a, at);
}

vec2 given_hint_at(ivec2 at) {
#if HINT && !SHUTTER
    return texelFetch(given_hint, at, 0).xy;
#else
    return vec2(0.0);
#endif
}

void store_hint(ivec2 at, vec2 value) {
#if HINT
    imageStore(hint, at, vec4(value, 0.0, 0.0));
#endif
}

#if DENOISE
const float kPixelVariance = 1.0 / 12.0;  // px^2

// Lower Cholesky factor (l11, l21, l22), px, of a covariance (xx, xy, yy) and the pixel's own. Stored in
// halves, a covariance would lose the width of a diagonal streak; its factor does not.
vec3 factor_of(vec3 covariance) {
    precise const float l11 = sqrt(covariance.x + kPixelVariance);
    precise const float l21 = covariance.y / l11;
    precise const float l22 =
        sqrt(max(covariance.z + kPixelVariance - l21 * l21, kPixelVariance));
    return vec3(l11, l21, l22);
}
#endif

// The mean of the soft samples and their share in the result; the covariance of their
// displacements.
void store_soft(Pixel pixel, Soft sums, float share_of) {
#if DENOISE
    const vec4 mean = value_of(sums.color, own_color(pixel));
    const float scale = 1.0 / max(sums.color.weight, 1e-6);
    imageStore(soft, pixel.at, vec4(mean.rgb, share_of * sums.color.weight));
    imageStore(spread, pixel.at, vec4(factor_of(scale * sums.spread), mean.a));
#endif
}

// Nothing is displaced into the pixel's block: it keeps its color to the bit.
void store_unchanged(Pixel pixel) {
    imageStore(blurred, pixel.at, own_color(pixel));
    store_unchanged_layers(pixel);
    store_hint(pixel.at, given_hint_at(pixel.at));
#if DENOISE
    imageStore(soft, pixel.at, vec4(0.0));
#endif
}

// Longest displacement of the pixel's own surface and of what its samples saw. An even disc has half of the
// squared radius as its second moment.
float longest_seen_px(Pixel pixel, Sums sums) {
    precise const float spread = 2.0 * sums.moment / max(sums.color.weight, 1e-6);
    const float seen = sqrt(max(sums.longest_path, spread));
    return min(max(longest_of(unpack_surface(pixel.own)), seen), pixel.longest_px);
}

// FXAA's pixel gate, 0..1: do the samples leave noise, by their number and how much they differ? A narrow blur
// has little noise beside detail that FXAA would soften.
float noise_gate(Sums sums) {
    const float weight = max(sums.color.weight, 1e-6);
    precise const vec2 mean = sums.shown.yz / weight;
    precise const float variance = max(mean.y - mean.x * mean.x, 0.0);
    precise const float noise = sqrt(variance / weight);
    precise const float radius_px = sqrt(2.0 * sums.moment / weight);
    precise const float gate =
        clamp((noise - kLeastNoise) / kMoreNoise, 0.0, 1.0) *
        clamp((radius_px - kLeastBlurPx) / kMoreBlurPx, 0.0, 1.0);
    return gate;
}

// gate: noise_gate()
vec2 hint_of(Pixel pixel, float gate) {
    precise const float in_focus = clamp(1.0 - abs(unpack_surface(pixel.own).radius), 0.0, 1.0);
    return kShutter ? vec2(1.0, gate) : given_hint_at(pixel.at) * in_focus;
}

void store_mean(Pixel pixel, Sums sums) {
    // From 0 at the limit, so that the blur begins without a jump.
    const float limit_px = max(uniforms.still_limit_px, 1e-6);
    precise const float onset = clamp(longest_seen_px(pixel, sums) / limit_px - 1.0, 0.0, 1.0);
    const vec4 own = own_color(pixel), mean = value_of(sums.color, own);
    imageStore(blurred, pixel.at, faded_in(own, with_front_over(pixel, kColor, mean), onset));
    store_layers(pixel, onset);
    precise const float share = onset * (1.0 - front_part(pixel.own)) / max(sums.color.weight, 1e-6);
    store_soft(pixel, sums.soft, share);
    store_hint(pixel.at, hint_of(pixel, noise_gate(sums)));
}

void add_samples(Pixel pixel, inout Sums sums) {
    // Without a lens, a search begins at the surface that the previous time sample has found.
    uvec4 begin = pixel.own;
    const float n = samples_of(pixel);
    const int count = int(ceil(n));
    // One more than needed: Mesa keeps arrays of up to 256 bytes in a GPU's registers, of which the
    // gather has none left.
    uvec2 deferred[kMaxDeferred + 1];
    int first = 0;
    SOFTWARE_LOOP do {
        int count_deferred = 0, k = first;
        SOFTWARE_LOOP do {
            const Sample now = sample_at(k, n, pixel);
            if (!passes_barrel(pixel, now)) continue;
            Search here = search(pixel, now, begin);
            if (here.nearest_edge)
                here.nearest.at = at_edge(here.nearest_at, here.nearest.at,
                                          here.nearest.inverse_depth, here.nearest.path, pixel.p, now);
            if (here.nearest_place != kOwnPlace)
                here.nearest.at = beside(here.nearest_at, here.nearest_place);
            if (is_settled(now, here)) {
                Found shown = here.nearest;
                shown.frame = 0;  // known to the compiler, which leaves all other sources out
                accumulate(sums, pixel, now, hit_of(shown, shown.at));
            } else {
                deferred[count_deferred++] = pack_search(k - first, here);
            }
        } while (++k < min(first + kMaxDeferred, count));
        int i = 0;
        if (count_deferred > 0) SOFTWARE_LOOP do {
            const uvec2 words = deferred[i];
            const Sample now = sample_at(first + number_of_search(words), n, pixel);
            accumulate(sums, pixel, now, resolve(pixel, now, unpack_search(words, pixel, now)));
        } while (++i < count_deferred);
        first += kMaxDeferred;
    } while (first < count);
}

void main() {
    ivec2 at;
    const bool is_pixel = next_pixel(uniforms.size, at);
    load_starts(at / kBlockPx);
    if (!is_pixel) return;
    const Pixel pixel = pixel_at(at);
    if (pixel.longest_px <= uniforms.still_limit_px) {
        store_unchanged(pixel);
        return;
    }
    const Circle circle = circle_of(unpack_surface(pixel.own).radius);
    Sums sums = no_samples();
    if (is_filled_by_one(pixel, circle)) {
        store_circle(pixel, circle);
        store_soft(pixel, sums.soft, 0.0);
        store_hint(pixel.at, hint_of(pixel, 0.0));
    } else {
        add_samples(pixel, sums);
        store_mean(pixel, sums);
    }
}
