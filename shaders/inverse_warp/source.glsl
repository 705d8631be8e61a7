// Where a sample's color comes from. Layers come from the same places as color.
//
// FILL_LAYER: one of the frame's layers is the fill mask (chain/frame/layers.h)

struct Source {
    int kind;     // the frame that shows it, -1 to 1; kSecondLayer; kContinuation; kFill
    vec2 at;      // px
    uvec2 cells;  // kContinuation: on both sides; kFill: bits of the inverse depth, and the pixel of the
                  // farthest surface visited
    bool beyond;  // this frame's border pixels, continued beyond it
};

const int kContinuation = 2, kFill = 3;

vec4 color_from(Source source, Plane plane) {
    if (source.kind == kSecondLayer) return second_color(source.at, plane);
    if (source.kind < kContinuation) return color_in(source.kind, source.at, plane);
    const vec4 far = fetch(WIDE(color, layers), plane, unpack_cell(source.cells.y));
    Cells cells = continuation_cells(source.cells, source.at);
    if (source.kind == kFill)
        cells = background_cells(source.at, uintBitsToFloat(source.cells.x));
    return color_of(cells, plane, far);
}

// Channels of the fill mask. The layer behind counts as a neighbor.
const vec4 kFromNeighbor = vec4(0.0, 1.0, 0.0, 0.0), kEstimated = vec4(0.0, 0.0, 1.0, 0.0);

// A layer's value at a source. The fill mask says that all of it comes from there; what this frame
// shows keeps its shares: an earlier pass may have filled it.
vec4 with_fill(Source source, int layer, vec4 value) {
#ifdef FILL_LAYER
    if (layer != uniforms.fill_layer || (source.kind == 0 && !source.beyond)) return value;
    const bool neighbor = source.kind == -1 || source.kind == 1 || source.kind == kSecondLayer;
    return precise_dot(value.rgb, vec3(1.0)) * (neighbor ? kFromNeighbor : kEstimated);
#else
    return value;
#endif
}
