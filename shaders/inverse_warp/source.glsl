// Where a sample's color comes from. Layers come from the same places as color.

struct Source {
    int kind;     // the frame that shows it, -1 to 1; kBehind; kFill
    vec2 at;      // px
    uvec2 cells;  // kBehind: on both sides; kFill: bits of the inverse depth, and the pixel of the
                  // farthest surface visited
};

const int kBehind = 2, kFill = 3;

vec4 color_from(Source source, Plane plane) {
    if (source.kind == kBehind) return color_behind(source.cells, source.at, plane);
    if (source.kind != kFill) return color_in(source.kind, source.at, plane);
    const vec4 far = fetch(WIDE(color, layers), plane, unpack_cell(source.cells.y));
    return background_at(source.at, uintBitsToFloat(source.cells.x), plane, far);
}
