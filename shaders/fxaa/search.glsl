// mode: search, the seven stages of FXAA 3.11 (quality path).
//
// N is up on the screen (row y - 1). Every comparison that a tie can decide is computed in fp32 in
// the paper's order of operations; `precise` forbids fusing and reordering. Deviations: the lumas
// along the edge are means of two or four texels instead of one bilinear fetch (the same numbers,
// without a filter weight that rounds); a range within rounding is not an edge even if both
// thresholds are 0.
//
// Needs uniforms, luma_at(), four_lumas(), inside(), color_at(), blend().

// Mean luma across the edge between the lines of p and q, `halves` half texels along it.
float line_luma(ivec2 p, ivec2 q, ivec2 along, int halves) {
    const ivec2 first = along * (halves >> 1);
    const ivec2 p0 = inside(p + first), q0 = inside(q + first);
    const ivec2 p1 = inside(p + first + along), q1 = inside(q + first + along);
    precise float here = 0.5 * (luma_at(p0.x, p0.y) + luma_at(q0.x, q0.y));
    precise float next = 0.5 * (luma_at(p1.x, p1.y) + luma_at(q1.x, q1.y));
    precise float both = 0.5 * (here + next);
    return (halves & 1) != 0 ? both : here;
}

// The end of the walk in one direction (`sense` 1 or -1): distance in half texels, and its last
// luma less the pair's mean.
void walk(ivec2 p, ivec2 q, ivec2 along, int sense, float pair_mean, float stop_at,
          out int reached, out float end) {
    reached = 0;
    end = 0.0;
    // Tested at its start: with all tests at the end of its body llvmpipe (Mesa 22.3) reads wrong
    // values of shared memory in this loop.
    const int last = uniforms.walk_length - 1;
    bool open = true;
    for (int i = 0; i < last; ++i) {
        reached = uniforms.walk[i >> 2][i & 3];
        precise float difference = line_luma(p, q, along, sense * reached) - pair_mean;
        end = difference;
        open = abs(difference) < stop_at;
        if (!open) break;
    }
    if (open) reached = uniforms.walk[last >> 2][last & 3];  // the last step moves without a fetch
}

// Stages 1 to 7 at p with both thresholds scaled.
vec4 filtered(ivec2 p, vec4 center, float threshold_scale) {
    // 1 local contrast
    const ivec2 low = max(p - 1, ivec2(0));
    const ivec2 high = min(p + 1, uniforms.size - 1);
    const float m = luma_at(p.x, p.y);
    const float n = luma_at(p.x, low.y);
    const float s = luma_at(p.x, high.y);
    const float w = luma_at(low.x, p.y);
    const float e = luma_at(high.x, p.y);
    const float highest = max(max(n, w), max(e, max(s, m)));
    const float lowest = min(min(n, w), min(e, min(s, m)));
    precise float range = highest - lowest;
    if (range < least_range(lowest, highest, threshold_scale)) return center;

    // 2 direction of the edge
    const float nw = luma_at(low.x, low.y);
    const float ne = luma_at(high.x, low.y);
    const float sw = luma_at(low.x, high.y);
    const float se = luma_at(high.x, high.y);
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
    int reached_negative, reached_positive;
    float end_negative, end_positive;
    walk(p, q, along, -1, pair_mean, stop_at, reached_negative, end_negative);
    walk(p, q, along, 1, pair_mean, stop_at, reached_positive, end_positive);

    // 6 the nearer end decides
    const bool negative_nearer = reached_negative < reached_positive;
    const float end = negative_nearer ? end_negative : end_positive;
    precise float side = m - pair_mean;
    precise float edge_offset = 0.0;
    if ((end < 0.0) != (side < 0.0))
        edge_offset = 0.5 - float(min(reached_negative, reached_positive)) /
                                float(reached_negative + reached_positive);

    // 7 a lerp of two texels
#ifdef LAYERS
    shares[place_of(inside(q) - p)] = share_of(center, color_at(q), max(edge_offset, subpix_offset));
#endif
    return blend(center, color_at(q), max(edge_offset, subpix_offset));
}
