#version 450 core
// The gather: each pixel averages samples along its tile's dominant direction and along its own,
// weighted by how likely each sample's blur covers it.
//
//   color, motion or half_velocity, inverse_depth, neighbor_max [, tile_variance] [, noise]
//   -> color [, hint]
//
// SINGLE: one direction, w_A = w_B = 1    VARIANCE: taps split by tile_variance, else every second
// TILE_JITTER, TAP_JITTER: random numbers are read    CLAMP: taps outside move to the border
// DOMINANT: slow pixels sample along v_max    DEPTH: inverse depths are compared    HINT: written
// LAYERS: number of extra layers
//
// Notation of the report: p this pixel, S a sample, v_c = v(p), w_c and w_max unit directions,
// T distance along the streak. Equations and deviations: docs/motion_blur.md.
#include "common/layers.glsl"
#include "common/software_loop.glsl"
#include "common/work_list.glsl"
#include "shared/motion_blur_uniforms.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D velocity;  // STORAGE: half_velocity, otherwise motion
layout(binding = 2) uniform sampler2D neighbor_max;
#if DEPTH
layout(binding = 3) uniform sampler2D inverse_depth;
#endif
#if VARIANCE
layout(binding = 4) uniform sampler2D tile_variance;
#endif
#if TILE_JITTER || TAP_JITTER
layout(binding = 5) uniform sampler2D noise;
#endif
layout(binding = 0) writeonly uniform image2D blurred;
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif
#ifdef LAYERS
layout(binding = 6) uniform sampler2DArray layers;
layout(binding = 2) writeonly uniform image2DArray layers_blurred;
#endif

#include "motion_blur/velocity.glsl"

const float kMinLengthPx = 0.5;  // rho(v) = max(|v|, 0.5)

vec2 velocity_at(ivec2 p) {
    const vec2 texel = texelFetch(velocity, p, 0).xy;
#if STORAGE
    return decode_velocity(texel);
#else
    const vec2 v = long_velocity(texel);
    return clamped_velocity(v, precise_dot(v, v));
#endif
}

// 1/|v|, finite for v = 0.
float inverse_length(float squared) {
    return inversesqrt(max(squared, 1e-30));
}

#if TILE_JITTER
// The tile of p, or near a border, with probability 0.5 - tau e at e tiles from it, the tile
// across. Only across the nearer of the two borders, never outside the grid.
ivec2 choose_tile(ivec2 p, ivec2 own, float random) {
    // In half pixels, so that equal distances and thresholds that a random number can hit are
    // exact: random < 0.5 - tau e with e = distance / (2 r).
    const ivec2 local = 2 * (p - own * uniforms.tile_px) + 1;
    const ivec2 distances = min(local, 2 * uniforms.tile_px - local);
    const bool along_x = distances.x <= distances.y;
    const float edge = float(uniforms.tile_px);
    const float e = float(along_x ? distances.x : distances.y);
    precise const float chance = random * 2.0 * edge + uniforms.tile_jitter_slope * e;
    if (chance >= edge) return own;
    const int side = (along_x ? local.x : local.y) < uniforms.tile_px ? -1 : 1;
    const ivec2 across = own + (along_x ? ivec2(side, 0) : ivec2(0, side));
    const bool outside =
        any(lessThan(across, ivec2(0))) || any(greaterThanEqual(across, uniforms.tiles));
    return outside ? own : across;
}
#endif

#if VARIANCE
// Bilinear by hand: a sampler may round the fractions to 8 bits.
float variance_at(ivec2 p) {
    precise const vec2 at = (vec2(p) + 0.5) / float(uniforms.tile_px) - 0.5;
    const ivec2 base = ivec2(floor(at));
    precise const vec2 f = at - vec2(base);
    const ivec2 low = max(base, ivec2(0));
    const ivec2 high = min(base + 1, uniforms.tiles - 1);
    const float top = precise_mix(texelFetch(tile_variance, low, 0).x,
                                  texelFetch(tile_variance, ivec2(high.x, low.y), 0).x, f.x);
    const float bottom = precise_mix(texelFetch(tile_variance, ivec2(low.x, high.y), 0).x,
                                     texelFetch(tile_variance, high, 0).x, f.x);
    return precise_mix(top, bottom, f.y);
}
#endif

// A still pixel keeps its color.
void keep(ivec2 p, vec4 color_p) {
    STORE(blurred, p, color_p);
#if HINT
    STORE(hint, p, vec4(0.0));
#endif
#ifdef LAYERS
    FOR_LAYERS(l) LAYER_STORE(layers_blurred, p, l, LAYER_FETCH(layers, p, l));
#endif
}

#if !SINGLE
// The pixel's own direction w_c: between that of v_c and, where v_c is short, one that v_max gives.
struct OwnDirection {
    vec2 w_c;
    vec2 w_other;        // on the other side of v_max
    bool on_both_sides;  // v_c is on neither side of v_max: samples of w_c and w_other
};

OwnDirection own_direction(vec2 v_c, float v_c_squared, float inverse_c, vec2 v_max, vec2 w_max) {
    // Where v_c is 0.
#if DOMINANT
    vec2 w_still = w_max;
#else
    vec2 w_still = vec2(-w_max.y, w_max.x);
#endif
    // w_p . v_c >= 0, by the unscaled vectors: exactly 0 if v_c is v_max.
#if DOMINANT
    precise const float side = precise_dot(v_max, v_c);
#else
    precise const float side = v_max.x * v_c.y - v_max.y * v_c.x;
#endif
    if (side < 0.0) w_still = -w_still;
    precise const float share =
        clamp((v_c_squared * inverse_c - kMinLengthPx) / uniforms.variance_threshold_px, 0.0, 1.0);
    OwnDirection own;
    own.w_c = precise_normalize(precise_mix(w_still, v_c * inverse_c, share));
    own.w_other = precise_normalize(precise_mix(-w_still, v_c * inverse_c, share));
    own.on_both_sides = side == 0.0 && share > 0.0 && share < 1.0;
    return own;
}
#endif

// 1/rho(v_S), and w_B = |w_S . d|, of the sample at s. per_motion: 1/(half the shutter), found once.
vec2 speed_of(ivec2 s, vec2 d, float per_motion) {
#if STORAGE
    const vec2 v_s = velocity_at(s);
    const float inverse_s = inverse_length(precise_dot(v_s, v_s));
    return vec2(min(inverse_s, 1.0 / kMinLengthPx), abs(precise_dot(v_s, d)) * inverse_s);
#else
    // From the motion itself: its direction is v_S's, and the clamp is enough for its length.
    const vec2 m_s = motion_of(texelFetch(velocity, s, 0).xy);
    const float inverse_s = inverse_length(precise_dot(m_s, m_s));
    const float inverse_rho_s =
        clamp(inverse_s * per_motion, 1.0 / float(uniforms.tile_px), 1.0 / kMinLengthPx);
    return vec2(inverse_rho_s, abs(precise_dot(m_s, d)) * inverse_s);
#endif
}

#if DEPTH
// One of front and back is 1; the other falls by this, with the ratio of the inverse depths.
float shown_behind(float q_p, float q_s) {
    const float far = min(q_p, q_s);
    const float near = max(q_p, q_s);
    // Computed for all, so that no branch is needed.
    precise const float behind =
        clamp(1.0 - uniforms.depth_softness * (near - far) / far, 0.0, 1.0);
    return near > far ? (far > 0.0 ? behind : 0.0) : 1.0;
}
#endif

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
    const vec4 color_p = finite_color(texelFetch(color, p, 0));
    // Pixel centers lie half a pixel from where the division could round to the next tile.
    precise const vec2 in_tiles = (vec2(p) + 0.5) / float(uniforms.tile_px);
    const ivec2 own_tile = ivec2(in_tiles);
#if TILE_JITTER || TAP_JITTER
    const vec2 random = texelFetch(noise, p & 127, 0).xy;
#endif
#if TILE_JITTER
    const ivec2 tile = choose_tile(p, own_tile, random.x);
#else
    const ivec2 tile = own_tile;
#endif
    // Never slower than v_c: every tile that can be chosen has this pixel's own among those whose
    // vectors it takes the longest of.
    const vec2 v_max = texelFetch(neighbor_max, tile, 0).xy;
    const float reach_squared = precise_dot(v_max, v_max);
    if (is_still(reach_squared)) {
        keep(p, color_p);
        return;
    }
    const float reach = sqrt(reach_squared);

    const vec2 v_c = velocity_at(p);
    const float v_c_squared = precise_dot(v_c, v_c);
    const float inverse_c = inverse_length(v_c_squared);
    const float inverse_rho_c = min(inverse_c, 1.0 / kMinLengthPx);
    const vec2 w_max = v_max / reach;
#if !SINGLE
    OwnDirection own = own_direction(v_c, v_c_squared, inverse_c, v_max, w_max);
    const float aligned = abs(precise_dot(own.w_c, w_max));
#endif
#if VARIANCE
    const float u = variance_at(p);
#endif
#if DEPTH
    const float q_p = texelFetch(inverse_depth, p, 0).x;
#endif
    const int count = uniforms.samples;
#if TAP_JITTER
    const float shift = float(1 - count) + 2.0 * uniforms.jitter * random.y;
#else
    const float shift = float(1 - count);
#endif
    const float spacing = reach / float(count + 1);
    const float per_motion = 1.0 / uniforms.half_shutter;
    // precise: equal weights and sums, bit for bit, in every variant of this program.
    precise float total = uniforms.center_total * inverse_rho_c;
#if !SINGLE
    if (own.on_both_sides) total *= 2.0;
#endif
    precise vec4 sum = vec4(0.0);
    precise float moment = 0.0;
#ifdef LAYERS
    vec4 layers_p[LAYERS];
    precise vec4 layer_sums[LAYERS];
    FOR_LAYERS(l) layers_p[l] = LAYER_FETCH(layers, p, l);
    FOR_LAYERS(l) layer_sums[l] = vec4(0.0);
#endif
    int i = 0;
    SOFTWARE_LOOP do {
        const float along = (float(2 * i) + shift) * spacing;  // t |v_max|
        const float distance = abs(along);
#if SINGLE
        const vec2 d = w_max;
        const float w_a = 1.0;
#else
#if VARIANCE
        const bool follows_own = floor(float(i + 1) * u) > floor(float(i) * u);
#else
        const bool follows_own = (i & 1) == 1;
#endif
        const vec2 d = follows_own ? own.w_c : w_max;
        const float w_a = follows_own ? 1.0 : aligned;
#endif
        ivec2 s = p + ivec2(floor(along * d + 0.5));
#if CLAMP
        s = clamp(s, ivec2(0), uniforms.size - 1);
        const bool counts = true;
#else
        const bool counts = all(lessThan(uvec2(s), uvec2(uniforms.size)));
#endif
        const vec2 speed = speed_of(s, d, per_motion);
        const float inverse_rho_s = speed.x;
#if SINGLE
        const float w_b = 1.0;
#else
        const float w_b = speed.y;
#endif
        precise float front = clamp(1.0 - distance * inverse_rho_s, 0.0, 1.0) * w_b;
        precise float back = clamp(1.0 - distance * inverse_rho_c, 0.0, 1.0) * w_a;
#if DEPTH
        const float q_s = texelFetch(inverse_depth, s, 0).x;
        const float shown = shown_behind(q_p, q_s);
        if (q_s < q_p) front *= shown;
        if (q_p < q_s) back *= shown;
#endif
        // cylinder = 1 - smoothstep(0.95 R, 1.05 R, T), R = min(rho(v_S), rho(v_c))
        const float edge =
            clamp(10.0 * distance * max(inverse_rho_s, inverse_rho_c) - 9.5, 0.0, 1.0);
        precise const float both = 1.0 - edge * edge * (3.0 - 2.0 * edge);
        precise const float weight = front + back + 2.0 * both * max(w_a, w_b);
        if (counts && weight > 0.0) {
            sum += weight * (finite_color(texelFetch(color, s, 0)) - color_p);
#ifdef LAYERS
            FOR_LAYERS(l) layer_sums[l] += weight * (LAYER_FETCH(layers, s, l) - layers_p[l]);
#endif
            total += weight;
            moment += weight * distance * distance;
        }
        ++i;
#if !SINGLE
        if (own.on_both_sides && i == count) {
            own.on_both_sides = false;
            i = 0;
            own.w_c = own.w_other;
        }
#endif
    } while (i < count);
    STORE(blurred, p, color_p + sum / total);
#ifdef LAYERS
    FOR_LAYERS(l) LAYER_STORE(layers_blurred, p, l, layers_p[l] + layer_sums[l] / total);
#endif
#if HINT
    // Half-length of the even streak with the same second moment about p.
    STORE(hint, p, vec4(1.0, 3.0 * moment > 0.25 * total ? 1.0 : 0.0, 0.0, 0.0));
#endif
}
