#version 450 core
// The gather: the mean over times and points of the lens of what stood at this pixel. For each of
// them the surface is searched by fixed-point iteration (Yang et al., Image-Based Bidirectional
// Scene Reprojection, 2011; Bowles et al., Iterative Image Warping, 2012): X <- p - D(X), from the
// pixel itself and from the tile's starts, nearest first. Of the positions X for which X + D(X) is p
// the nearest surface counts. Where there is none, or where a start's surface may be hidden, a
// neighboring frame may have seen it; else the background around shows the farthest surface met.
//
//   color, surfaces, starts, background_color, background_depth [, lens_points] [, noise] [, hint]
//       -> color [, soft, spread] [, hint]
//   color, surfaces of the frames before and after
//
// SHUTTER, LENS: which of the two are open    STARTS: starts of a tile at most
// BEFORE, AFTER: that frame is searched       NOISE: noise is read
// BARREL: the lens barrel cuts the aperture away from the picture's middle
// DENOISE: what blurred samples have seen goes to `soft` and `spread`, for denoise.comp
// ADAPTIVE: tiles whose samples disagree take uniforms.more_samples more
// LAYERS: so many further layers too, with those of the background and of the neighbors
// HINT: written; of the lens alone: read too  LIST: only the blocks of a work list
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_list.glsl"

#include "inverse_warp/surface.glsl"

#include "inverse_warp/background.glsl"
#include "inverse_warp/color.glsl"
#include "inverse_warp/samples.glsl"
#if DENOISE
#include "inverse_warp/soft.glsl"
#endif
#if ADAPTIVE
#include "inverse_warp/adaptive.glsl"
#endif

#define NEIGHBORS (BEFORE || AFTER)

layout(binding = 0) uniform sampler2D color;  // linear
layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 2) uniform usampler2D starts;
#if NOISE
layout(binding = 3) uniform sampler2D noise;
#endif
#if DENOISE
layout(binding = 2) writeonly uniform image2D soft;
layout(binding = 3) writeonly uniform image2D spread;
#endif
#if HINT && !SHUTTER
layout(binding = 6) uniform sampler2D given_hint;
#endif
layout(binding = 0) writeonly uniform image2D blurred;
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif

#ifdef LAYERS
layout(binding = 13) uniform sampler2DArray layers;  // linear
layout(binding = 4) writeonly uniform image2DArray layers_blurred;
#if DENOISE
layout(binding = 5) writeonly uniform image2DArray layers_soft;
#endif
#endif

const float kAcceptPx = 0.75;   // |X + D(X) - p| along each axis
const int kSteps = 2;           // of the iteration from each start
const int kOwnSteps = LENS == 1 && SHUTTER == 0 ? 1 : 2;  // from the pixel itself

#include "inverse_warp/sums.glsl"

// What a sample meets in this frame.
struct Met {
    bool found;
    vec2 at;              // the place that it sees; where nothing is found, of what is hidden there
    float inverse_depth;  // of that surface
    vec2 path;            // likewise, a
    ivec2 far;            // pixel of the farthest surface met
};

// What this frame shows of it; what is hidden goes on behind what hides it.
vec4 shown(Met met) {
    if (met.found) {
#ifdef LAYERS
        layers_at(color, layers, met.at, seen_layers);
#endif
        return color_at(color, met.at);
    }
    const vec4 far_color = texelFetch(color, met.far, 0);
#ifdef LAYERS
    FOR_LAYERS(l) seen_layers[l] = LAYER_FETCH(layers, met.far, l);
    return background_at(met.at, met.inverse_depth, far_color, seen_layers);
#else
    return background_at(met.at, met.inverse_depth, far_color);
#endif
}

#if NEIGHBORS
#include "inverse_warp/neighbors.glsl"
#endif

void main() {
    ivec2 pixel;
    const bool is_own = next_pixel(uniforms.size, pixel);
#if ADAPTIVE
    // All of a tile meet at its sum. A group beyond the list has none.
    if (!is_own && all(lessThan(pixel, uniforms.size))) return;
    pixel = min(pixel, uniforms.size - 1);
#else
    if (!is_own) return;
#endif
    const ivec2 tile = pixel / kBlockPx;
    const int row = (STARTS + 1) * tile.x;
    begin_sums(pixel);
    const uvec4 summary = texelFetch(starts, ivec2(row + STARTS, tile.y), 0);
    const float longest = uintBitsToFloat(summary.x);
#if HINT && !SHUTTER
    const vec2 hint_p = texelFetch(given_hint, pixel, 0).xy;
#endif
    if (longest <= uniforms.still_limit_px) {
        if (!is_own) return;
        STORE(blurred, pixel, own_color);
#if DENOISE
        STORE(soft, pixel, vec4(0.0));
#endif
#if HINT && SHUTTER
        STORE(hint, pixel, vec4(0.0));
#elif HINT
        STORE(hint, pixel, vec4(hint_p, 0.0, 0.0));
#endif
#ifdef LAYERS
        FOR_LAYERS(l) LAYER_STORE(layers_blurred, pixel, l, own_layers[l]);
#endif
        return;
    }
    Surface start[STARTS];
    const int count = int(summary.y);
    for (int i = 0; i < STARTS; ++i)
        start[i] = unpack_surface(texelFetch(starts, ivec2(row + i, tile.y), 0));

    float samples = samples_of(longest);
    int last = int(ceil(samples));
#if NOISE
    const vec2 random = texelFetch(noise, pixel & 127, 0).xy;
#else
    const vec2 random = vec2(0.0);
#endif
    const vec2 p = vec2(pixel);
    // Where the search begins: what the pixel shows, or, of the shutter alone, what the time before
    // has found there.
    Surface own = unpack_surface(texelFetch(surfaces, pixel, 0));
#if HINT && !SHUTTER
    const float own_radius = abs(own.radius);
#endif
    float moment = 0.0, counted = 0.0;
#if BARREL
    const vec2 barrel = uniforms.barrel_per_px * (p - vec2(uniforms.middle_x, uniforms.middle_y));
#endif
    int begin_points = 0;
    float share = 1.0;  // of each sample's weight
    bool again;
#if ADAPTIVE
    float share_of_more = 0.0;  // weight of the samples beyond the first set
    begin_tile();
#endif
    do {
        again = false;
        for (int k = 0; k < last; ++k) {
            const Sample at = sample_at(k, samples, begin_points, share, random);
#if BARREL
            const vec2 passed = uniforms.barrel_scale * at.lens + barrel;
            if (dot(passed, passed) > 1.0) continue;
#endif
            counted += at.weight;
            const float one_depth = one_depth_at(k, random);
            float nearest = -1.0, residual = kAcceptPx;
            float hidden = -1.0;  // starts no nearer than this are not searched
            float far_residual = 3.4e38;
            vec2 found_at = p, far_at = p, path = vec2(0.0);
            Surface far = own;  // the farthest met by this sample
            far.inverse_depth = 3.4e38;
            vec2 d = displacement(own, at);
            int next = 0, step_count = 0;
            bool more;
#if NEIGHBORS
            float first = -1.0;  // inverse depth of what the first step has come to
            uint hidden_starts = 0u;  // a bit each: what is not farther stands in their way, or
                                      // they lie beyond the picture
#endif
            do {
                // Beyond the picture its last pixels go on. Found as a distance from p: far from the
                // picture's origin a position has fewer digits.
                const vec2 to_x = floor(0.5 - d);
                const vec2 x = p + to_x;
                const vec2 inside = inside_of(x);
                const Surface s = unpack_surface(texelFetch(surfaces, ivec2(inside), 0));
                d = displacement(s, at);
                const vec2 off = abs(to_x + d);
                const float error = max(off.x, off.y);
#if NEIGHBORS
                // What lies beyond the picture a neighbor may have seen.
                const bool accepted = error <= kAcceptPx && x == inside;
#else
                const bool accepted = error <= kAcceptPx;
#endif
                const float q = s.inverse_depth;
#if NEIGHBORS
                if (first < 0.0) first = q;
#endif
                if (accepted &&
                    (q > nearest * one_depth || (q * one_depth >= nearest && error < residual))) {
                    nearest = q;
                    residual = error;
                    found_at = s.edge ? inside : inside_of(p - d);
#if SHUTTER
                    path = s.a;
#endif
                }
                if (q * one_depth < far.inverse_depth ||
                    (q <= far.inverse_depth * one_depth && error < far_residual)) {
                    far = s;
                    far_residual = error;
                    far_at = inside;
                }
#if !LENS
                if (accepted && next == 0) own = s;
#endif
                ++step_count;
                more = true;
#if NEIGHBORS
                for (int i = 0; i < STARTS; ++i)
                    if (i + 1 == next && !accepted &&
                        (x != inside || q * one_depth >= start[i].inverse_depth))
                        hidden_starts |= 1u << i;
#endif
                if (accepted || step_count >= (next == 0 ? kOwnSteps : kSteps)) {
                    // From the next start, unless what was found hides all that is left: what the
                    // pixel itself has led to, all that is not nearer; what a start has, only what
                    // is farther, because the order of starts must not count.
                    hidden = next == 0 ? nearest * one_depth : max(hidden, nearest / one_depth);
                    step_count = 0;
                    more = next < count;
                    for (int i = 0; i < STARTS; ++i) {
                        if (i != next || !more) continue;
                        d = displacement(start[i], at);
                        more = start[i].inverse_depth > hidden;
                    }
                    ++next;
                }
            } while (more);
            const bool found = nearest >= 0.0;
#if SHUTTER
            const vec2 far_path = far.a;
#else
            const vec2 far_path = vec2(0.0);
#endif
            const Met met = Met(found, found ? found_at : inside_of(p - displacement(far, at)),
                                found ? nearest : far.inverse_depth, found ? path : far_path,
                                ivec2(far_at));
            moment += at.weight * dot(met.at - p, met.at - p);
#if NEIGHBORS
            // What is hidden in this frame is mostly seen in the one before or after.
            Seen seen;
            const bool shows_behind = far.inverse_depth * one_depth < first;
            if ((!found || hidden_starts != 0u) &&
                seen_by_neighbors(p, at, one_depth, far, shows_behind, start, hidden_starts, nearest,
                                  seen)) {
                add_sample(k, seen.color, seen.inverse_depth, seen.path, at.weight);
                continue;
            }
#endif
            add_sample(k, shown(met), met.inverse_depth, met.path, at.weight);
        }
#if ADAPTIVE
        if (begin_points == 0) {
            share_of_more = share_of_more_in(tile, is_own ? noise_of(halves, own_color.rgb) : 0.0);
            again = share_of_more > 0.0;
            if (again) {
                begin_points = last;
                last = uniforms.more_samples;
                samples = float(last);
                share = share_of_more;
            }
        }
#endif
    } while (again);
#if ADAPTIVE
    if (!is_own) return;
#endif
    // Without a jump where the blur begins.
    const float onset = clamp(longest / max(uniforms.still_limit_px, 1e-6) - 1.0, 0.0, 1.0);
    const float mean_of = onset / max(counted, 1.0);
    STORE(blurred, pixel, own_color + mean_of * sum);
#ifdef LAYERS
    FOR_LAYERS(l) LAYER_STORE(layers_blurred, pixel, l, own_layers[l] + mean_of * layer_sums[l]);
#endif
#if DENOISE
    const float of_soft = 1.0 / max(soft_sum.weight, 1e-6);
    const vec4 soft_color = own_color + of_soft * soft_sum.sum;
    const float soft_share = is_finite(soft_color) ? mean_of * soft_sum.weight : 0.0;
    STORE(soft, pixel, vec4(soft_color.rgb, soft_share));
#if ADAPTIVE
    // The window that so many samples have everywhere.
    const float narrower = inversesqrt(
        1.0 + share_of_more * float(uniforms.more_samples) / float(uniforms.samples));
#else
    const float narrower = 1.0;
#endif
    STORE(spread, pixel,
          vec4(narrower * of_soft * soft_sum.spread, soft_color.a));
#ifdef LAYERS
    FOR_LAYERS(l) LAYER_STORE(layers_soft, pixel, l, own_layers[l] + of_soft * soft_layers[l]);
#endif
#endif
#if HINT && SHUTTER
    // Half-length of the even streak with the same second moment about p.
    STORE(hint, pixel, vec4(1.0, 3.0 * moment > 0.25 * counted ? 1.0 : 0.0, 0.0, 0.0));
#elif HINT
    STORE(hint, pixel, vec4(hint_p * clamp(1.0 - own_radius, 0.0, 1.0), 0.0, 0.0));
#endif
}
