#version 450 core
// The open shutter: the mean over times of what stood at this pixel. For each time the surface is
// searched by fixed-point iteration (Yang et al., Image-Based Bidirectional Scene Reprojection,
// 2011; Bowles et al., Iterative Image Warping, 2012): X <- p - D(X; u), from the pixel itself and
// from the tile's starts, nearest first. Of the positions X for which X + D(X; u) is p the nearest
// surface counts; where there is none, the background nearest to p on the way to the farthest
// surface met.
//
//   color, surfaces, starts [, noise] -> color [, hint]
//
// JITTER: noise is read    HINT: written    LIST: only the blocks of a work list
// STARTS: starts of a tile at most
#include "common/work_list.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D color;  // linear
layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 2) uniform usampler2D starts;
#if JITTER
layout(binding = 3) uniform sampler2D noise;
#endif
layout(binding = 0) writeonly uniform image2D blurred;
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif

const float kAcceptPx = 0.75;   // |X + D(X; u) - p| along each axis
const float kNearer = 1.02;     // inverse depths within this ratio: the smaller residual counts
const int kSteps = 2;           // of the iteration from each start
const int kLeastTimes = 5;
const int kHalvings = 2;
const float kSharpening = 2.0;  // of bilinear weights about their middle: half the added blur

// Color of the surface that is seen at `at`, pixels.
vec4 color_at(vec2 at) {
    const vec2 base = floor(at);
    const vec2 f = clamp(kSharpening * (at - base - 0.5) + 0.5, 0.0, 1.0);
    return textureLod(color, (base + f + 0.5) / vec2(block.size), 0.0);
}

void main() {
    ivec2 pixel;
    if (!next_pixel(block.size, pixel)) return;
    const ivec2 tile = pixel / kBlockPx;
    const int row = (STARTS + 1) * tile.x;
    const vec4 color_p = texelFetch(color, pixel, 0);
    const uvec4 summary = texelFetch(starts, ivec2(row + STARTS, tile.y), 0);
    const float longest = uintBitsToFloat(summary.x);
    if (longest <= block.still_limit_px) {
        imageStore(blurred, pixel, color_p);
#if HINT
        imageStore(hint, pixel, vec4(0.0));
#endif
        return;
    }
    Surface start[STARTS];
    const int count = int(summary.y);
    for (int i = 0; i < STARTS; ++i)
        start[i] = unpack_surface(texelFetch(starts, ivec2(row + i, tile.y), 0));

    const int times = clamp(int(ceil(2.0 * longest / block.path_px_per_time)), kLeastTimes,
                            max(block.samples, kLeastTimes));
#if JITTER
    const float shift = 0.5 + 0.5 * block.time_jitter * texelFetch(noise, pixel & 127, 0).y;
#else
    const float shift = 0.5;
#endif
    const vec2 p = vec2(pixel);
    const vec2 last = vec2(block.size - 1);
    const float bend = min(block.half_shutter, 1.0);
    // Where the search begins: what the pixel shows, or what the time before has found there.
    Surface own = unpack_surface(texelFetch(surfaces, pixel, 0));
    vec4 sum = vec4(0.0);
    float moment = 0.0;
    int time = 0;
    do {
        const float u = 2.0 * (float(time) + shift) / float(times) - 1.0;
        const float bend_u = bend * u * u;
        float nearest = -1.0, residual = kAcceptPx, farthest = 3.4e38;
        vec2 found_at = p, far_at = p;
        vec2 d = displacement(own.a, own.b, own.straight, u, bend_u);
        int next = 0, step_count = 0;
        bool more;
        do {
            // Beyond the picture its last pixels go on.
            const vec2 x = floor(p - d + 0.5);
            const vec2 inside = clamp(x, vec2(0.0), last);
            const Surface s = unpack_surface(texelFetch(surfaces, ivec2(inside), 0));
            d = displacement(s.a, s.b, s.straight, u, bend_u);
            const vec2 to = p - d;
            const vec2 off = abs(x - to);
            const float error = max(off.x, off.y);
            const bool accepted = error <= kAcceptPx;
            const float q = s.inverse_depth;
            if (accepted && (q > nearest * kNearer || (q * kNearer >= nearest && error < residual))) {
                nearest = q;
                residual = error;
                found_at = s.edge ? inside : clamp(to, vec2(0.0), last);
            }
            if (q < farthest) {
                farthest = q;
                far_at = inside;
            }
            if (accepted && next == 0) own = s;
            ++step_count;
            more = true;
            if (accepted || step_count >= kSteps) {
                // From the next start, unless what was found hides all that is left.
                step_count = 0;
                more = next < count;
                for (int i = 0; i < STARTS; ++i) {
                    if (i != next || !more) continue;
                    d = displacement(start[i].a, start[i].b, start[i].straight, u, bend_u);
                    more = start[i].inverse_depth > nearest * kNearer;
                }
                ++next;
            }
        } while (more);
        // The way to the background, halved.
        vec2 from = p;
        for (int i = 0; i < kHalvings; ++i) {
            const vec2 middle = floor(0.5 * (from + far_at) + 0.5);
            const float q = inverse_depth_of(texelFetch(surfaces, ivec2(middle), 0));
            const bool is_far = q <= kOneDepth * farthest;
            far_at = is_far ? middle : far_at;
            from = is_far ? from : middle;
        }
        const vec2 at = nearest >= 0.0 ? found_at : far_at;
        sum += color_at(at) - color_p;
        moment += dot(at - p, at - p);
        ++time;
    } while (time < times);
    imageStore(blurred, pixel, color_p + sum / float(times));
#if HINT
    // Half-length of the even streak with the same second moment about p.
    imageStore(hint, pixel, vec4(1.0, 3.0 * moment > 0.25 * float(times) ? 1.0 : 0.0, 0.0, 0.0));
#endif
}
