#version 450 core
// The gather: the mean over times and points of the lens of what stood at this pixel. For each of
// them the surface is searched by fixed-point iteration (Yang et al., Image-Based Bidirectional
// Scene Reprojection, 2011; Bowles et al., Iterative Image Warping, 2012): X <- p - D(X), from the
// pixel itself and from the tile's starts, nearest first. Of the positions X for which X + D(X) is p
// the nearest surface counts; where there is none, what a neighboring frame saw there, or what the
// background around shows of the farthest surface met.
//
//   color, surfaces, starts, background_color, background_depth [, lens_points] [, noise] [, hint]
//       -> color [, soft, spread] [, hint]
//   color, surfaces of the frames before and after
//
// SHUTTER, LENS: which of the two are open    STARTS: starts of a tile at most
// BEFORE, AFTER: that frame is searched       NOISE: noise is read
// BARREL: the lens barrel cuts the aperture away from the picture's middle
// DENOISE: what blurred samples have seen goes to `soft` and `spread`, for denoise.comp
// ADAPTIVE: tiles whose samples disagree take block.more_samples more
// LAYERS: so many further layers too, with those of the background and of the neighbors
// HINT: written; of the lens alone: read too  LIST: only the blocks of a work list
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_list.glsl"

#include "inverse_warp/surface.glsl"

#include "inverse_warp/background.glsl"
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
#if LENS
layout(binding = 4) uniform sampler2D lens_points;
#endif
#if DENOISE
layout(binding = 2) writeonly uniform image2D soft;
layout(binding = 3) writeonly uniform image2D spread;
#endif
#if HINT && !SHUTTER
layout(binding = 6) uniform sampler2D given_hint;
#endif
#if BEFORE
layout(binding = 7) uniform sampler2D color_before;  // linear
layout(binding = 8) uniform usampler2D surfaces_before;
#endif
#if AFTER
layout(binding = 9) uniform sampler2D color_after;  // linear
layout(binding = 10) uniform usampler2D surfaces_after;
#endif
layout(binding = 0) writeonly uniform image2D blurred;
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif

#ifdef LAYERS
layout(binding = 13) uniform sampler2DArray layers;  // linear
#if BEFORE
layout(binding = 15) uniform sampler2DArray layers_before;  // linear
#endif
#if AFTER
layout(binding = 5) uniform sampler2DArray layers_after;  // linear
#endif
layout(binding = 4) writeonly uniform image2DArray layers_blurred;
#if DENOISE
layout(binding = 5) writeonly uniform image2DArray layers_soft;
#endif
#endif

const float kAcceptPx = 0.75;   // |X + D(X) - p| along each axis
const float kAcceptNeighborPx = 1.0;
// Inverse depths within a ratio of at most so much: the smaller residual counts.
const float kOneDepthLeast = 1.01, kOneDepthMost = 1.03;
const int kSteps = 2;           // of the iteration from each start
const int kOwnSteps = LENS == 1 && SHUTTER == 0 ? 1 : 2;  // from the pixel itself
const float kSharpening = 2.0;  // of bilinear weights about their middle: half the added blur

// Where the bilinear filter has the weights of the place `at`, pixels.
vec2 sampled_at(vec2 at) {
    const vec2 base = floor(at);
    const vec2 f = clamp(kSharpening * (at - base - 0.5) + 0.5, 0.0, 1.0);
    return (base + f + 0.5) / vec2(block.size);
}

// Color of the surface that is seen at `at`, pixels.
vec4 color_at(sampler2D plane, vec2 at) {
    const vec4 c = textureLod(plane, sampled_at(at), 0.0);
    // A weight of 0 times what is not finite is NaN: then the nearest pixel alone counts.
    return is_finite(c) ? c : texelFetch(plane, ivec2(at + 0.5), 0);
}

#ifdef LAYERS
// The same of layers. They are finite where color is not, too: color's pixel alone counts there.
void layers_at(sampler2D plane, sampler2DArray planes, vec2 at, out vec4 seen[LAYERS]) {
    const vec2 place = sampled_at(at);
    const bool mixed = is_finite(textureLod(plane, place, 0.0));
    FOR_LAYERS(l)
        seen[l] = mixed ? textureLod(planes, vec3(place, float(LAYERS_FIRST + l)), 0.0)
                        : LAYER_FETCH(planes, ivec2(at + 0.5), l);
}
#endif

vec2 inside_of(vec2 at) {
    return clamp(at, vec2(0.0), vec2(block.size - 1));
}

// How many samples a pixel takes. The last may be part of one, so that nothing jumps where a longer
// path gets a time more.
float samples_of(float longest) {
#if LENS
    return float(block.samples);
#else
    return clamp(2.0 * longest / block.path_px_per_time, float(INVERSE_WARP_LEAST_TIMES),
                 float(max(block.samples, INVERSE_WARP_LEAST_TIMES)));
#endif
}

// Sample k of a set of n, whose points of the lens begin at `begin`. random: x in [0, 1), y in [-1, 1)
Sample sample_at(int k, float n, int begin, vec2 random) {
    Sample at;
    at.weight = min(n - float(k), 1.0);
#if SHUTTER && LENS
    const float place = float(bitfieldReverse(uint(k)) >> 8) / 16777216.0;
    at.u = 2.0 * fract(place + 0.5 / n + 0.5 + 0.5 * random.y) - 1.0;
#elif SHUTTER
    at.u = 2.0 * (float(k) + 0.5 * at.weight * (1.0 + block.time_jitter * random.y)) / n - 1.0;
#else
    at.u = 0.0;
#endif
    at.bend = min(block.half_shutter, 1.0) * at.u * at.u;
#if LENS
    const int set = min(int(random.x * float(block.lens_sets)), block.lens_sets - 1);
    at.lens = texelFetch(lens_points, ivec2(begin + k, set), 0).xy;
#else
    at.lens = vec2(0.0);
#endif
    return at;
}

// The ratio of inverse depths beyond which the nearer surface counts, another for each sample: while
// two surfaces pass each other in depth, their samples change over one by one.
float one_depth_at(int k, vec2 random) {
    return mix(kOneDepthLeast, kOneDepthMost, fract(random.x + 0.618034 * float(k)));
}

#if DENOISE
// Samples of surfaces whose displacements spread by more than block.soft_spread.
struct Soft {
    vec4 sum;     // of differences to the pixel's own color
    float weight;
    vec3 spread;  // sum of covariances of the displacements: xx, xy, yy, px^2
};

// Variance along x and y, px^2: more changes no window, and its determinant would be lost in
// rounding.
const float kMostSpread = 65536.0;

// Does the sample count? path: of the surface on one side of the frame, a
bool add_soft(inout Soft soft, vec4 difference, float inverse_depth, vec2 path, float weight) {
    vec3 covariance = vec3(0.0);
#if LENS
    const float radius = radius_px(inverse_depth);
    covariance.xz += 0.25 * radius * radius;  // of a disc
#endif
#if SHUTTER
    covariance += path.xxy * path.xyy / 3.0;  // of a straight line
#endif
    const float variance = covariance.x + covariance.z;
    if (variance < block.soft_spread || !is_finite(difference)) return false;
    covariance *= min(kMostSpread / variance, 1.0);
    soft.sum += weight * difference;
    soft.weight += weight;
    soft.spread += weight * covariance;
    return true;
}
#endif

#if NEIGHBORS
// The same displacement with the motion of a frame, whatever is blurred: a neighbor is a frame away.
vec2 displacement_from_neighbor(Surface s, Sample at) {
#if LENS
    return moved(s, at) + s.radius * at.lens;
#else
    return moved(s, at);
#endif
}
#endif

void main() {
    ivec2 pixel;
    const bool is_own = next_pixel(block.size, pixel);
#if ADAPTIVE
    // All of a tile meet at its sum. A group beyond the list has none.
    if (!is_own && all(lessThan(pixel, block.size))) return;
    pixel = min(pixel, block.size - 1);
#else
    if (!is_own) return;
#endif
    const ivec2 tile = pixel / kBlockPx;
    const int row = (STARTS + 1) * tile.x;
    const vec4 color_p = texelFetch(color, pixel, 0);
    const uvec4 summary = texelFetch(starts, ivec2(row + STARTS, tile.y), 0);
    const float longest = uintBitsToFloat(summary.x);
#if HINT && !SHUTTER
    const vec2 hint_p = texelFetch(given_hint, pixel, 0).xy;
#endif
    if (longest <= block.still_limit_px) {
        if (!is_own) return;
        STORE(blurred, pixel, color_p);
#if DENOISE
        STORE(soft, pixel, vec4(0.0));
#endif
#if HINT && SHUTTER
        STORE(hint, pixel, vec4(0.0));
#elif HINT
        STORE(hint, pixel, vec4(hint_p, 0.0, 0.0));
#endif
#ifdef LAYERS
        FOR_LAYERS(l) LAYER_STORE(layers_blurred, pixel, l, LAYER_FETCH(layers, pixel, l));
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
#if DENOISE
    Soft blurred_samples = Soft(vec4(0.0), 0.0, vec3(0.0));
#endif
    vec4 sum = vec4(0.0);
#ifdef LAYERS
    vec4 layers_p[LAYERS], layer_sums[LAYERS], seen_layers[LAYERS];
#if DENOISE
    vec4 soft_layers[LAYERS];  // sums of differences to the pixel's own
#endif
    FOR_LAYERS(l) {
        layers_p[l] = LAYER_FETCH(layers, pixel, l);
        layer_sums[l] = vec4(0.0);
#if DENOISE
        soft_layers[l] = vec4(0.0);
#endif
    }
#endif
    float moment = 0.0;
#if NEIGHBORS
    Surface background = own;  // the farthest met
#endif
#if BARREL
    const vec2 barrel = block.barrel_per_px * (p - vec2(block.middle_x, block.middle_y));
#endif
    float counted = 0.0;
    int first = 0, begin_points = 0;
#if ADAPTIVE
    Halves halves = Halves(vec3[2](vec3(0.0), vec3(0.0)), float[2](0.0, 0.0));
    float share_of_more = 0.0;  // weight of the samples beyond the first set
    begin_tile();
#endif
    do {  // 32 samples at a time, a bit each for those that found nothing
        const int end = min(first + 32, last);
#if NEIGHBORS
        uint missed = 0u;
        vec4 filled = vec4(0.0);
#ifdef LAYERS
        vec4 filled_layers[LAYERS];
        FOR_LAYERS(l) filled_layers[l] = vec4(0.0);
#endif
        float missed_weight = 0.0;
#endif
        int k = first;
        do {
            Sample at = sample_at(k, samples, begin_points, random);
#if ADAPTIVE
            if (begin_points > 0) at.weight = share_of_more;
#endif
#if BARREL
            const vec2 passed = block.barrel_scale * at.lens + barrel;
            if (dot(passed, passed) > 1.0) {
                ++k;
                continue;
            }
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
                if (accepted &&
                    (q > nearest * one_depth || (q * one_depth >= nearest && error < residual))) {
                    nearest = q;
                    residual = error;
                    found_at = s.edge ? inside : inside_of(p - d);
#if DENOISE && SHUTTER
                    path = s.a;
#endif
                }
                if (q * one_depth < far.inverse_depth ||
                    (q <= far.inverse_depth * one_depth && error < far_residual)) {
                    far = s;
                    far_residual = error;
                    far_at = inside;
                }
#if NEIGHBORS
                if (q * one_depth < background.inverse_depth) background = s;
#endif
#if !LENS
                if (accepted && next == 0) own = s;
#endif
                ++step_count;
                more = true;
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
#if DENOISE && SHUTTER
            if (!found) path = far.a;
#endif
            const vec2 seen_at = found ? found_at : inside_of(p - displacement(far, at));
            vec4 seen;
#ifdef LAYERS
            if (found) {
                seen = color_at(color, seen_at);
                layers_at(color, layers, seen_at, seen_layers);
            } else {
                FOR_LAYERS(l) seen_layers[l] = LAYER_FETCH(layers, ivec2(far_at), l);
                seen = background_at(seen_at, far.inverse_depth,
                                     texelFetch(color, ivec2(far_at), 0), seen_layers);
            }
#else
            if (found)
                seen = color_at(color, seen_at);
            else
                seen = background_at(seen_at, far.inverse_depth,
                                     texelFetch(color, ivec2(far_at), 0));
#endif
            moment += at.weight * dot(seen_at - p, seen_at - p);
#if NEIGHBORS
            if (!found) {
                missed |= 1u << (k - first);
                filled += at.weight * (seen - color_p);
#ifdef LAYERS
                FOR_LAYERS(l) filled_layers[l] += at.weight * (seen_layers[l] - layers_p[l]);
#endif
                missed_weight += at.weight;
            } else
#endif
            {
                sum += at.weight * (seen - color_p);
#if ADAPTIVE
                add_to_half(halves, k, seen - color_p, at.weight);
#endif
#if DENOISE
                const bool is_soft = add_soft(blurred_samples, seen - color_p,
                                              found ? nearest : far.inverse_depth, path, at.weight);
#endif
#ifdef LAYERS
                FOR_LAYERS(l) layer_sums[l] += at.weight * (seen_layers[l] - layers_p[l]);
#if DENOISE
                if (is_soft)
                    FOR_LAYERS(l) soft_layers[l] += at.weight * (seen_layers[l] - layers_p[l]);
#endif
#endif
            }
            ++k;
        } while (k < end);
#if NEIGHBORS
        // What is hidden in this frame is mostly seen in the one before or after.
        const float frame = 1.0 / block.half_shutter;
        float found_weight = 0.0;
        while (missed != 0u) {
            k = first + findLSB(missed);
            missed &= missed - 1u;
            Sample now = sample_at(k, samples, begin_points, random);
#if ADAPTIVE
            if (begin_points > 0) now.weight = share_of_more;
#endif
            const float one_depth = one_depth_at(k, random);
            vec4 seen = vec4(0.0);
            vec2 path = vec2(0.0);
            float nearest = -1.0;
            // In both frames, the nearer in time first, from the background; where that finds
            // nothing, from the starts.
            int search = 0;
            bool more;
            do {
#if BEFORE && AFTER
                const bool after = ((search & 1) == 0) == (now.u >= 0.0);
                const int index = search >> 1;
#else
                const bool after = AFTER == 1;
                const int index = search;
#endif
                Sample at = now;
                at.u = after ? now.u - frame : now.u + frame;
                at.bend = min(block.half_shutter, 1.0) * at.u * at.u;
                Surface begin = background;
                for (int i = 0; i < STARTS; ++i)
                    if (i + 1 == index) begin = start[i];
                // Straight: a parabola about this frame is none about that one.
                begin.b = vec2(0.0);
                vec2 d = displacement_from_neighbor(begin, at);
                for (int i = 0; i < kSteps; ++i) {
                    const vec2 x = inside_of(p + floor(0.5 - d));
                    uvec4 bits;
#if BEFORE && AFTER
                    if (after) bits = texelFetch(surfaces_after, ivec2(x), 0);
                    else bits = texelFetch(surfaces_before, ivec2(x), 0);
#elif AFTER
                    bits = texelFetch(surfaces_after, ivec2(x), 0);
#else
                    bits = texelFetch(surfaces_before, ivec2(x), 0);
#endif
                    const Surface s = unpack_surface(bits);
                    d = displacement_from_neighbor(s, at);
                    const vec2 off = abs(x - p + d);
                    if (max(off.x, off.y) > kAcceptNeighborPx ||
                        s.inverse_depth <= nearest * one_depth)
                        continue;
                    nearest = s.inverse_depth;
                    path = s.a;
                    const vec2 where = s.edge ? x : inside_of(p - d);
#if BEFORE && AFTER
                    if (after) seen = color_at(color_after, where);
                    else seen = color_at(color_before, where);
#elif AFTER
                    seen = color_at(color_after, where);
#else
                    seen = color_at(color_before, where);
#endif
#ifdef LAYERS
#if AFTER
                    if (after) layers_at(color_after, layers_after, where, seen_layers);
#endif
#if BEFORE
                    if (!after) layers_at(color_before, layers_before, where, seen_layers);
#endif
#endif
                }
                ++search;
                const int frames = BEFORE + AFTER;
                more = search < frames || (nearest < 0.0 && search < frames * (1 + count));
            } while (more);
            if (nearest >= 0.0) {
                sum += now.weight * (seen - color_p);
                found_weight += now.weight;
#if ADAPTIVE
                add_to_half(halves, k, seen - color_p, now.weight);
#endif
#if DENOISE
                const bool is_soft =
                    add_soft(blurred_samples, seen - color_p, nearest, path, now.weight);
#endif
#ifdef LAYERS
                FOR_LAYERS(l) layer_sums[l] += now.weight * (seen_layers[l] - layers_p[l]);
#if DENOISE
                if (is_soft)
                    FOR_LAYERS(l) soft_layers[l] += now.weight * (seen_layers[l] - layers_p[l]);
#endif
#endif
            }
        }
        // The mean of the fills stands for what no frame has seen.
        if (missed_weight > 0.0) sum += filled * ((missed_weight - found_weight) / missed_weight);
#ifdef LAYERS
        if (missed_weight > 0.0)
            FOR_LAYERS(l)
                layer_sums[l] +=
                    filled_layers[l] * ((missed_weight - found_weight) / missed_weight);
#endif
#endif
        first = end;
#if ADAPTIVE
        if (first >= last && begin_points == 0) {
            share_of_more = share_of_more_in(tile, is_own ? noise_of(halves, color_p.rgb) : 0.0);
            if (share_of_more > 0.0) {
                begin_points = last;
                first = 0;
                last = block.more_samples;
                samples = float(last);
            }
        }
#endif
    } while (first < last);
#if ADAPTIVE
    if (!is_own) return;
#endif
    // Without a jump where the blur begins.
    const float onset = clamp(longest / max(block.still_limit_px, 1e-6) - 1.0, 0.0, 1.0);
    const float mean_of = onset / max(counted, 1.0);
    STORE(blurred, pixel, color_p + mean_of * sum);
#ifdef LAYERS
    FOR_LAYERS(l) LAYER_STORE(layers_blurred, pixel, l, layers_p[l] + mean_of * layer_sums[l]);
#endif
#if DENOISE
    const float of_soft = 1.0 / max(blurred_samples.weight, 1e-6);
    const vec4 soft_color = color_p + of_soft * blurred_samples.sum;
    const float share = is_finite(soft_color) ? mean_of * blurred_samples.weight : 0.0;
    STORE(soft, pixel, vec4(soft_color.rgb, share));
#if ADAPTIVE
    // The window that so many samples have everywhere.
    const float narrower = inversesqrt(
        1.0 + share_of_more * float(block.more_samples) / float(block.samples));
#else
    const float narrower = 1.0;
#endif
    STORE(spread, pixel,
          vec4(narrower * of_soft * blurred_samples.spread, soft_color.a));
#ifdef LAYERS
    FOR_LAYERS(l) LAYER_STORE(layers_soft, pixel, l, layers_p[l] + of_soft * soft_layers[l]);
#endif
#endif
#if HINT && SHUTTER
    // Half-length of the even streak with the same second moment about p.
    STORE(hint, pixel, vec4(1.0, 3.0 * moment > 0.25 * counted ? 1.0 : 0.0, 0.0, 0.0));
#elif HINT
    STORE(hint, pixel, vec4(hint_p * clamp(1.0 - own_radius, 0.0, 1.0), 0.0, 0.0));
#endif
}
