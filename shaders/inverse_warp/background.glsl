// The fill of surfaces that no frame shows, from the cells of background.comp.
#include "common/software_loop.glsl"

// Cells of one size (cells.glsl).
struct CellLevel {
    ivec2 cells;
    ivec2 first;  // texel of the first
    vec2 place;  // of the position to fill, in cells
};

// Cells whose colors are averaged. A total of 0: none.
struct Cells {
    ivec2 at[4];
    float weight[4];
    float total;
};

// The four cells around, bilinear, each by the part of it that shows a surface with at most this
// inverse depth.
Cells cells_around(CellLevel level, float inverse_depth) {
    const vec2 base = floor(level.place);
    precise const vec2 f = level.place - base;
    Cells cells;
    precise float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 corner = ivec2(i & 1, i >> 1);
        cells.at[i] = level.first + clamp(ivec2(base) + corner, ivec2(0), level.cells - 1);
        vec2 depth_part = texelFetch(background, cells.at[i], 0).xy;
        depth_part.y = part_of(depth_part.y);
        precise const vec2 w = mix(1.0 - f, f, bvec2(corner));
        precise const float weight = w.x * w.y * depth_part.y;
        cells.weight[i] = depth_part.x > kOneDepth * inverse_depth ? 0.0 : weight;
        total += cells.weight[i];
    }
    cells.total = total;
    return cells;
}

// The smallest cells around the position `at`, pixels, that show a surface with at most this inverse
// depth.
Cells background_cells(vec2 at, float inverse_depth) {
    precise CellLevel level = CellLevel(8 * uniforms.blocks, ivec2(0), 0.5 * (at + 0.5) - 0.5);
    Cells cells;
    SOFTWARE_LOOP do {
        cells = cells_around(level, inverse_depth);
        level.first = ivec2(first_of_4().x, level.first.x == 0 ? 0 : level.first.y + level.cells.y);
        level.cells /= 2;
        level.place = 0.5 * level.place - 0.25;
    } while (cells.total == 0.0 && level.cells.x >= uniforms.blocks.x);
    return cells;
}

// The mean color of cells; if there are none: `otherwise`.
vec4 color_of(Cells cells, Plane plane, vec4 otherwise) {
    vec4 first = otherwise;
    precise vec4 sum = vec4(0.0);
    bool is_first = true;
    for (int i = 0; i < 4; ++i) {
        if (cells.weight[i] == 0.0) continue;
        const vec4 c = fetch(WIDE(background_color, background_layers), plane, cells.at[i]);
        if (is_first) first = c;
        is_first = false;
        // By the difference: one color stays to the bit.
        sum += cells.weight[i] * (c - first);
    }
    precise const vec4 mean = first + sum / cells.total;
    return cells.total > 0.0 ? mean : otherwise;
}
