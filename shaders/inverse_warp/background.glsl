// The fill of surfaces that no frame shows, from the cells of background.comp.

// Cells of one size (cells.glsl).
struct CellLevel {
    ivec2 cells;
    ivec2 first;  // texel of the first
    vec2 place;  // of the position to fill, in cells
};

// Takes `fill` from the four cells around, bilinear, each by the part of it that shows a surface
// with at most this inverse depth. False if there is none.
bool fill_from(CellLevel level, float inverse_depth, Plane plane, inout vec4 fill) {
    const vec2 base = floor(level.place);
    precise const vec2 f = level.place - base;
    vec4 first = fill;
    precise vec4 sum = vec4(0.0);
    precise float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 corner = ivec2(i & 1, i >> 1);
        const ivec2 cell =
            level.first + clamp(ivec2(base) + corner, ivec2(0), level.cells - 1);
        vec2 depth_part = texelFetch(background, cell, 0).xy;
        depth_part.y = part_of(depth_part.y);
        precise const vec2 w = mix(1.0 - f, f, bvec2(corner));
        const float weight = w.x * w.y * depth_part.y;
        if (weight == 0.0 || depth_part.x > kOneDepth * inverse_depth) continue;
        const vec4 c = fetch(WIDE(background_color, background_layers), plane, cell);
        if (total == 0.0) first = c;
        // By the difference: one color stays to the bit.
        sum += weight * (c - first);
        total += weight;
    }
    precise const vec4 mean = first + sum / total;
    if (total > 0.0) fill = mean;
    return total > 0.0;
}

// The color at the position `at`, pixels, of a surface with at most this inverse depth, from the
// smallest cells around that show one. If none does: `otherwise`.
vec4 background_at(vec2 at, float inverse_depth, Plane plane, vec4 otherwise) {
    vec4 fill = otherwise;
    precise CellLevel level = CellLevel(8 * uniforms.blocks, ivec2(0), 0.5 * (at + 0.5) - 0.5);
    bool filled;
    do {
        filled = fill_from(level, inverse_depth, plane, fill);
        level.first = ivec2(first_of_4().x, level.first.x == 0 ? 0 : level.first.y + level.cells.y);
        level.cells /= 2;
        level.place = 0.5 * level.place - 0.25;
    } while (!filled && level.cells.x >= uniforms.blocks.x);
    return fill;
}
