#version 450 core
// The farthest surface in each cell of 2, 4, 8 and 16 pixels' edge: its mean color, its inverse
// depth, and the part of the cell that shows it. The gather fills occluded surfaces from them.
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

const float kEdgeWeight = 0.25;  // of an edge pixel whose color is mixed with the nearer surface's

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
    float inverse_depth;
    float weight;  // pixels; 0: empty
};

Cell empty() {
    return Cell(vec4(0.0), 0.0, 0.0);
}

// The farther one, or the mean of both if they are one surface.
Cell merge(Cell a, Cell b) {
    if (a.weight == 0.0) return b;
    if (b.weight == 0.0) return a;
    if (!one_depth(a.inverse_depth, b.inverse_depth))
        return a.inverse_depth < b.inverse_depth ? a : b;
    precise const float weight = a.weight + b.weight;
    // By the difference: one color stays to the bit.
    precise const vec4 color = a.color + b.weight / weight * (b.color - a.color);
    return Cell(color, min(a.inverse_depth, b.inverse_depth), weight);
}

Cell pixel(ivec2 at) {
    if (any(greaterThanEqual(at, uniforms.size))) return empty();
    const vec4 c = fetch(WIDE(color, layers), this_plane(), at);
    const uvec4 bits = texelFetch(surfaces, at, 0);
    const Surface s = unpack_surface(bits);
    const bool own_color = has_place(bits) && place_in(bits) == kOwnPlace;
    return Cell(c, s.inverse_depth, s.edge && !own_color ? kEdgeWeight : 1.0);
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

// Cells of 4 px and 8 px of the work group, each at its first square.
shared Cell cells[kSquares];

// The cell of square k, and three more of its size, whose edge is given in squares.
Cell merge_cells(int k, Cell cell, int edge) {
    uint left = 14u;
    SOFTWARE_LOOP do {
        const ivec2 offset = edge * corner(findLSB(left));
        cell = merge(cell, cells[k + offset.y * kBlockPx + offset.x]);
        left &= left - 1u;
    } while (left != 0u);
    return cell;
}

void main() {
    const int k = int(gl_LocalInvocationIndex);
    const ivec2 square = square_of(k);
    const bool is_cell = all(lessThan(square, 4 * uniforms.blocks));
    Cell of_4 = empty();
    if (is_cell) {
        int i = 0;
        SOFTWARE_LOOP do {
            const ivec2 at = 2 * square + corner(i);
            const Cell of_2 = merge_pixels(2 * at);
            store(of_2, at, 4.0);
            of_4 = merge(of_4, of_2);
        } while (++i < 4);
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
