// The fill of surfaces that no frame shows, from the cells of background.comp.
#include "common/software_loop.glsl"

// Cells of one size (cells.glsl).
struct CellLevel {
    ivec2 cells;
    ivec2 first;  // texel of the first
    vec2 place;  // of the position to fill, in cells
};

// Cells whose colors are averaged: two in each ivec4. A total of 0: none.
struct Cells {
    ivec4 upper, lower;
    vec4 weights;
    float total;
};

float depth_of_cell(ivec2 cell) {
    return texelFetch(background, cell, 0).x;
}

// The weight w of a cell, by the part of it that shows a surface with at most this inverse depth.
float weight_of(ivec2 cell, float w, float inverse_depth) {
    const vec2 depth_part = texelFetch(background, cell, 0).xy;
    precise const float weight = w * part_of(depth_part.y);
    return depth_part.x > kOneDepth * inverse_depth ? 0.0 : weight;
}

// The four cells around, bilinear, each by the part of it that shows a surface with at most this
// inverse depth.
Cells cells_around(CellLevel level, float inverse_depth) {
    const vec2 base = floor(level.place);
    precise const vec2 f = level.place - base, g = 1.0 - f;
    const ivec2 low = level.first + clamp(ivec2(base), ivec2(0), level.cells - 1);
    const ivec2 high = level.first + clamp(ivec2(base) + 1, ivec2(0), level.cells - 1);
    Cells cells;
    cells.upper = ivec4(low, high.x, low.y);
    cells.lower = ivec4(low.x, high.y, high);
    precise const vec4 shares = vec4(g.x, f.x, g.x, f.x) * vec4(g.y, g.y, f.y, f.y);
    cells.weights = vec4(weight_of(cells.upper.xy, shares.x, inverse_depth),
                         weight_of(cells.upper.zw, shares.y, inverse_depth),
                         weight_of(cells.lower.xy, shares.z, inverse_depth),
                         weight_of(cells.lower.zw, shares.w, inverse_depth));
    precise const float total =
        cells.weights.x + cells.weights.y + cells.weights.z + cells.weights.w;
    cells.total = total;
    return cells;
}

// The cells of 2 px; `at`: the position to fill, pixels.
CellLevel smallest_cells(vec2 at) {
    precise const vec2 place = 0.5 * (at + 0.5) - 0.5;
    return CellLevel(8 * uniforms.blocks, ivec2(0), place);
}

// The smallest cells around the position `at`, pixels, that show a surface with at most this inverse
// depth.
Cells background_cells(vec2 at, float inverse_depth) {
    precise CellLevel level = smallest_cells(at);
    Cells cells = cells_around(level, inverse_depth);
    // The `if` also keeps the cells of a lane that has ended: llvmpipe 22.3 overwrites what only the body
    // of a loop defines, while other lanes go on.
    if (cells.total == 0.0) SOFTWARE_LOOP do {
        level.first = ivec2(first_of_4().x, level.first.x == 0 ? 0 : level.first.y + level.cells.y);
        level.cells /= 2;
        level.place = 0.5 * level.place - 0.25;
        cells = cells_around(level, inverse_depth);
    } while (cells.total == 0.0 && level.cells.x > uniforms.blocks.x);
    return cells;
}

// A sum of differences to the first color: one color stays to the bit.
struct CellSum {
    vec4 first;
    vec4 sum;
    bool is_empty;
};

void add_cell(precise inout CellSum cells, Plane plane, ivec2 cell, float weight) {
    if (weight == 0.0) return;
    const vec4 c = fetch(WIDE(background_color, background_layers), plane, cell);
    if (cells.is_empty) cells.first = c;
    cells.is_empty = false;
    cells.sum += weight * (c - cells.first);
}

// The mean color of cells; if there are none: `otherwise`.
vec4 color_of(Cells cells, Plane plane, vec4 otherwise) {
    CellSum all = CellSum(otherwise, vec4(0.0), true);
    add_cell(all, plane, cells.upper.xy, cells.weights.x);
    add_cell(all, plane, cells.upper.zw, cells.weights.y);
    add_cell(all, plane, cells.lower.xy, cells.weights.z);
    add_cell(all, plane, cells.lower.zw, cells.weights.w);
    precise const vec4 mean = all.first + all.sum / cells.total;
    return cells.total > 0.0 ? mean : otherwise;
}
