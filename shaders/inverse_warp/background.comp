#version 450 core
// The farthest surface in each cell of 2, 4, 8 and 16 pixels' edge: its mean color, its inverse
// depth, and the part of the cell that shows it, in which lamps count less. The gather fills occluded
// surfaces from them.
//
//   color, surfaces -> background_color, background_depth   12 blocks.x by 8 blocks.y (cells.glsl)
//
// LAYERS: defined if the frame has extra layers -> background_layers. Work groups z of 1 and more average
// layer z - 1.
#define DENSE
#include "common/software_loop.glsl"

#include "inverse_warp/cells.glsl"
#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"
#include "inverse_warp/wide_color.glsl"

#include "inverse_warp/mixture.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform image2D background_color;
layout(binding = 1) writeonly uniform image2D background_depth;
#ifdef LAYERS
layout(binding = 2) uniform sampler2DArray layers;
layout(binding = 2) writeonly uniform image2DArray background_layers;
#endif

// The one that this work group averages.
Plane this_plane() {
#ifdef LAYERS
    return Plane(gl_WorkGroupID.z == 0u, int(gl_WorkGroupID.z) - 1);
#else
    return kColor;
#endif
}

struct Cell {
    vec4 color;
    float brightness;  // of `color`, also if a layer is averaged: all planes have the same weights
    float inverse_depth;
    float weight;  // pixels; 0: empty
};

Cell empty() {
    return Cell(vec4(0.0), 0.0, 0.0, 0.0);
}

// The farther one, or the mean of both if they are one surface.
Cell merge(Cell a, Cell b) {
    if (a.weight == 0.0) return b;
    if (b.weight == 0.0) return a;
    if (!one_depth(a.inverse_depth, b.inverse_depth))
        return a.inverse_depth < b.inverse_depth ? a : b;
    precise const float weight = a.weight + b.weight;
    // By the difference: one color stays to the bit.
    precise const float share = b.weight / weight;
    precise const vec4 color = a.color + share * (b.color - a.color);
    precise const float brightness = a.brightness + share * (b.brightness - a.brightness);
    return Cell(color, brightness, min(a.inverse_depth, b.inverse_depth), weight);
}

// A cell much brighter than `level` shows a lamp: it has less weight.
Cell dimmed(Cell cell, float level) {
    precise const float limit = kLamp * level;
    if (!(cell.brightness > limit)) return cell;
    precise const float part = limit / cell.brightness;
    precise const float weight = max(part * part, kLeastLampPart) * cell.weight;
    cell.weight = weight;
    return cell;
}

float farthest_of(Cell a, Cell b) {
    const float q = a.weight > 0.0 ? a.inverse_depth : 3.0e38,
                r = b.weight > 0.0 ? b.inverse_depth : 3.0e38;
    return min(q, r);
}

float brightness_of(Cell cell, float farthest) {
    return cell.weight > 0.0 && one_depth(cell.inverse_depth, farthest) ? cell.brightness : 3.0e38;
}

// Merges four cells. Their level is the second lowest brightness of those that show the farthest surface.
Cell merge(Cell a, Cell b, Cell c, Cell d) {
    const float farthest = min(farthest_of(a, b), farthest_of(c, d));
    const vec4 all = vec4(brightness_of(a, farthest), brightness_of(b, farthest),
                          brightness_of(c, farthest), brightness_of(d, farthest));
    const vec2 low = min(all.xz, all.yw), high = max(all.xz, all.yw);
    const float level = min(max(low.x, low.y), min(high.x, high.y));
    const Cell ab = merge(dimmed(a, level), dimmed(b, level));
    return merge(merge(ab, dimmed(c, level)), dimmed(d, level));
}

Cell pixel(ivec2 at) {
    if (any(greaterThanEqual(at, uniforms.size))) return empty();
    const uvec4 bits = texelFetch(surfaces, at, 0);
    // A surface that stays in front of this one is no part of it.
    const uint place = front_in(bits) != kOwnPlace ? place_in(bits) : kOwnPlace;
    const ivec2 from = ivec2(beside(vec2(at), place));
    const vec4 c = fetch(WIDE(color, layers), this_plane(), from);
    const vec4 light = fetch(WIDE(color, layers), kColor, from);
    const float brightness = max(max(light.r, 0.0), max(light.g, light.b));
    const Surface s = unpack_surface(bits);
    const bool own_color = has_place(bits) && place_in(bits) == kOwnPlace;
    return Cell(c, brightness, s.inverse_depth, s.edge && !own_color ? kEdgeWeight : 1.0);
}

void store(Cell cell, ivec2 at, float pixels) {
#ifdef LAYERS
    const Plane plane = this_plane();
    if (!plane.is_color) {
        imageStore(background_layers, ivec3(at, plane.layer), cell.color);
        return;
    }
#endif
    imageStore(background_color, at, cell.color);
    imageStore(background_depth, at, vec4(cell.inverse_depth, cell.weight / pixels, 0.0, 0.0));
}

ivec2 corner(int i) {
    return ivec2(i & 1, i >> 1);
}

// Compilers do not unroll a loop over bits: llvmpipe compiles it sooner, and runs it in the same time.
Cell merge_pixels(ivec2 at) {
    Cell cell = empty();
    uint left = 15u;
    SOFTWARE_LOOP do {
        cell = merge(cell, pixel(at + corner(findLSB(left))));
        left &= left - 1u;
    } while (left != 0u);
    return cell;
}

// Stores a cell of 2 px.
Cell store_pixels(ivec2 at) {
    const Cell cell = merge_pixels(2 * at);
    store(cell, at, 4.0);
    return cell;
}

// Cells of 4 px and 8 px of the work group, each at its first square.
shared Cell cells[kSquares];

// The cell of square k, and three more of its size, whose edge is given in squares.
Cell merge_cells(int k, Cell cell, int edge) {
    return merge(cell, cells[k + edge], cells[k + edge * kBlockPx],
                 cells[k + edge * kBlockPx + edge]);
}

void main() {
    const int k = int(gl_LocalInvocationIndex);
    const ivec2 square = square_of(k);
    const bool is_cell = all(lessThan(square, 4 * uniforms.blocks));
    Cell of_4 = empty();
    if (is_cell) {
        const ivec2 at = 2 * square;
        of_4 = merge(store_pixels(at), store_pixels(at + ivec2(1, 0)),
                     store_pixels(at + ivec2(0, 1)), store_pixels(at + 1));
        store(of_4, first_of_4() + square, 16.0);
    }
    // A cell that another contains at its first square stays with the thread.
    const bool is_8 = is_cell && (square.x & 1) == 0 && (square.y & 1) == 0;
    const bool is_16 = is_8 && (square.x & 3) == 0 && (square.y & 3) == 0;
    if (!is_8) cells[k] = of_4;
    barrier();
    Cell of_8;
    if (is_8) {
        of_8 = merge_cells(k, of_4, 1);
        store(of_8, first_of_8() + square / 2, 64.0);
        if (!is_16) cells[k] = of_8;
    }
    barrier();
    if (is_16) store(merge_cells(k, of_8, 2), first_of_16() + square / 4, 256.0);
}
