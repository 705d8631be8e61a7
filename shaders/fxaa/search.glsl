// mode: search, the seven stages of FXAA 3.11 (quality path).
//
// N is up on the screen (row y - 1). Every comparison that a tie can decide is computed in fp32 in
// the paper's order of operations; `precise` forbids fusing and reordering. Deviations: the lumas
// along the edge are means of two or four texels instead of one bilinear fetch (the same numbers,
// without a filter weight that rounds); a range within rounding is not an edge even if both
// thresholds are 0.
//
// Needs uniforms, luma_at(), luma_beside(), inside(), color_at(), blend().
#include "common/software_loop.glsl"

// Mean luma across the edge between the lines of p and q, `halves` half texels along it. Both texels
// along the edge are read even if one is enough: a branch is no faster on a software renderer.
float line_luma(ivec2 p, ivec2 q, ivec2 along, int halves) {
    const ivec2 first = along * (halves >> 1);
    const ivec2 second = first + along;
    precise float here = 0.5 * (luma_at(p + first) + luma_at(q + first));
    precise float next = 0.5 * (luma_at(p + second) + luma_at(q + second));
    precise float both = 0.5 * (here + next);
    return (halves & 1) != 0 ? both : here;
}

// The end of the walk in one direction.
struct End {
    int reached;  // distance in half texels
    float luma;   // the last luma less the pair's mean
    bool open;    // it is not an end yet
};

void step_to(int distance, int sense, ivec2 p, ivec2 q, ivec2 along, float pair_mean, float stop_at,
             inout End end) {
    precise float difference = line_luma(p, q, along, sense * distance) - pair_mean;
    if (!end.open) return;
    end.reached = distance;
    end.luma = difference;
    end.open = abs(difference) < stop_at;
}

// Walks in both directions in one loop.
void walk(ivec2 p, ivec2 q, ivec2 along, float pair_mean, float stop_at, out End backward,
          out End forward) {
    backward = forward = End(0, 0.0, true);
    const int last = uniforms.walk_length - 1;
    int i = 0;
    SOFTWARE_LOOP do {
        const int distance = uniforms.walk[i >> 2][i & 3];
        step_to(distance, -1, p, q, along, pair_mean, stop_at, backward);
        step_to(distance, 1, p, q, along, pair_mean, stop_at, forward);
        ++i;
    } while (i < last && (backward.open || forward.open));
    // The last step moves without a fetch.
    const int farthest = uniforms.walk[last >> 2][last & 3];
    if (backward.open) backward.reached = farthest;
    if (forward.open) forward.reached = farthest;
}

// Stages 1 to 7 at p with both thresholds scaled.
vec4 filtered(ivec2 p, vec4 center, float threshold_scale) {
    // 1 local contrast
    const float m = luma_beside(p, ivec2(0));
    const float n = luma_beside(p, ivec2(0, -1));
    const float s = luma_beside(p, ivec2(0, 1));
    const float w = luma_beside(p, ivec2(-1, 0));
    const float e = luma_beside(p, ivec2(1, 0));
    const float highest = max(max(n, w), max(e, max(s, m)));
    const float lowest = min(min(n, w), min(e, min(s, m)));
    precise float range = highest - lowest;
    if (range < least_range(lowest, highest, center, threshold_scale)) return center;

    // 2 direction of the edge
    const float nw = luma_beside(p, ivec2(-1, -1));
    const float ne = luma_beside(p, ivec2(1, -1));
    const float sw = luma_beside(p, ivec2(-1, 1));
    const float se = luma_beside(p, ivec2(1, 1));
    precise float across_rows = abs(-2.0 * m + (n + s)) * 2.0 + abs(-2.0 * e + (ne + se)) +
                                abs(-2.0 * w + (nw + sw));
    precise float across_columns = abs(-2.0 * m + (w + e)) * 2.0 + abs(-2.0 * n + (nw + ne)) +
                                   abs(-2.0 * s + (sw + se));
    const bool horizontal = across_rows >= across_columns;

    // 3 the neighbor on the other side of the edge
    const float before = horizontal ? n : w;
    const float after = horizontal ? s : e;
    precise float gradient_before = abs(before - m);
    precise float gradient_after = abs(after - m);
    const bool towards_before = gradient_before >= gradient_after;
    const ivec2 positive = horizontal ? ivec2(0, 1) : ivec2(1, 0);
    const ivec2 q = towards_before ? p - positive : p + positive;
    const ivec2 along = positive.yx;
    precise float pair_mean = ((towards_before ? before : after) + m) * 0.5;
    precise float stop_at = max(gradient_before, gradient_after) * 0.25;

    // 4 sub-pixel offset
    precise float around = ((n + s) + (w + e)) * 2.0 + ((nw + sw) + (ne + se));
    precise float t = clamp(abs(around / 12.0 - m) / range, 0.0, 1.0);
    precise float f = t * t * (3.0 - 2.0 * t);
    precise float subpix_offset = f * f * uniforms.subpix;

    // 5 both ends of the edge
    End backward, forward;
    walk(p, q, along, pair_mean, stop_at, backward, forward);

    // 6 the nearer end decides
    const float end = backward.reached < forward.reached ? backward.luma : forward.luma;
    precise float side = m - pair_mean;
    precise float edge_offset = 0.0;
    if ((end < 0.0) != (side < 0.0))
        edge_offset = 0.5 - float(min(backward.reached, forward.reached)) /
                                float(backward.reached + forward.reached);

    // 7 a lerp of two texels
#ifdef LAYERS
    shares[place_of(inside(q) - p)] = share_of(center, color_at(q), max(edge_offset, subpix_offset));
#endif
    return blend(center, color_at(q), max(edge_offset, subpix_offset));
}
