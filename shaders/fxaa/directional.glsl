// mode: directional, a Gaussian over 3x3 pixels, long along the edge and narrow across it.
//
// Direction and coherence: structure tensor (Förstner and Gülch 1987) of the lumas' central
// differences at M, N, S, E, W. No edges are classified: except for the threshold the filter is
// continuous in the lumas.
//
// Needs uniforms, luma_beside(), color_at(), brightness_weight().
#include "common/precise.glsl"

// Standard deviations, pixels. If the tensor has no direction both are kRound.
const float kAcross = 0.46;
const float kAlong = 0.8;
const float kRound = 0.5;

// Adds the texel at `offset` from p, whose color is `center`, to the sum and to the sum of the weights.
void add(precise inout vec4 sum, precise inout float weights, ivec2 p, vec4 center, ivec2 offset,
         float weight) {
    const vec4 texel = color_at(p + offset);
    const float share = weight * brightness_weight(texel, center);
#ifdef LAYERS
    const int place = place_of(inside(p + offset) - p);
    precise const float of_place = shares[place] + share;
    shares[place] = of_place;
#endif
    sum += share * texel;
    weights += share;
}

// The mean around M with both thresholds scaled; M itself, bit for bit, below them.
vec4 filtered(ivec2 p, vec4 center, float threshold_scale) {
    // The twelve lumas of the diamond around M.
    const float m = luma_beside(p, ivec2(0));
    const float n = luma_beside(p, ivec2(0, -1)), nn = luma_beside(p, ivec2(0, -2));
    const float s = luma_beside(p, ivec2(0, 1)), ss = luma_beside(p, ivec2(0, 2));
    const float w = luma_beside(p, ivec2(-1, 0)), ww = luma_beside(p, ivec2(-2, 0));
    const float e = luma_beside(p, ivec2(1, 0)), ee = luma_beside(p, ivec2(2, 0));
    const float nw = luma_beside(p, ivec2(-1, -1)), ne = luma_beside(p, ivec2(1, -1));
    const float sw = luma_beside(p, ivec2(-1, 1)), se = luma_beside(p, ivec2(1, 1));

    const float highest = max(max(n, w), max(e, max(s, m)));
    const float lowest = min(min(n, w), min(e, min(s, m)));
    precise float range = highest - lowest;
    if (range < least_range(lowest, highest, center, threshold_scale)) return center;

    vec2 at_m = vec2(e - w, s - n);
    vec2 at_n = vec2(ne - nw, m - nn);
    vec2 at_s = vec2(se - sw, ss - m);
    vec2 at_w = vec2(m - ww, sw - nw);
    vec2 at_e = vec2(ee - m, se - ne);
    // Scaled so that no square leaves the range of floats.
    const vec2 most = max(max(abs(at_m), max(abs(at_n), abs(at_s))), max(abs(at_w), abs(at_e)));
    const float scale = max(most.x, most.y) > 0.0 ? 1.0 / max(most.x, most.y) : 0.0;
    at_m *= scale;
    at_n *= scale;
    at_s *= scale;
    at_w *= scale;
    at_e *= scale;
    const vec2 squares = at_m * at_m + at_n * at_n + at_s * at_s + at_w * at_w + at_e * at_e;
    const float product =
        at_m.x * at_m.y + at_n.x * at_n.y + at_s.x * at_s.y + at_w.x * at_w.y + at_e.x * at_e.y;

    // Coherence, and (cos, sin) of twice the angle of the direction across the edge.
    const float trace = squares.x + squares.y;
    const vec2 twice =
        trace > 0.0 ? vec2(squares.x - squares.y, 2.0 * product) / trace : vec2(0.0);
    const float coherence = min(precise_length(twice), 1.0);
    const vec2 axis = coherence > 0.0 ? twice / coherence : vec2(0.0);
    const float across = precise_mix(kRound, kAcross, coherence);
    const float along = precise_mix(kRound, kAlong, coherence);
    const float k_across = 0.5 / (across * across);
    const float k_along = 0.5 / (along * along);

    // The weight of a neighbor at d is exp(-k_across (d . normal)^2 - k_along (d . tangent)^2).
    const float mean_k = 0.5 * (k_across + k_along);
    const vec2 change = 0.5 * (k_across - k_along) * axis;
    precise const float weight_x = exp(-(mean_k + change.x));
    precise const float weight_y = exp(-(mean_k - change.x));
    precise const float weight_falling = exp(-2.0 * (mean_k + change.y));  // (1, 1) and (-1, -1)
    precise const float weight_rising = exp(-2.0 * (mean_k - change.y));   // (1, -1) and (-1, 1)

    vec4 sum = vec4(0.0);
    float weights = 0.0;
    add(sum, weights, p, center, ivec2(0), 1.0);
    add(sum, weights, p, center, ivec2(-1, 0), weight_x);
    add(sum, weights, p, center, ivec2(1, 0), weight_x);
    add(sum, weights, p, center, ivec2(0, -1), weight_y);
    add(sum, weights, p, center, ivec2(0, 1), weight_y);
    add(sum, weights, p, center, ivec2(-1, -1), weight_falling);
    add(sum, weights, p, center, ivec2(1, 1), weight_falling);
    add(sum, weights, p, center, ivec2(1, -1), weight_rising);
    add(sum, weights, p, center, ivec2(-1, 1), weight_rising);
#ifdef LAYERS
    for (int i = 0; i < 9; ++i) shares[i] /= weights;
#endif
    return sum / weights;
}
