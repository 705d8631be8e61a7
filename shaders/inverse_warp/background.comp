#version 450 core
// The farthest surface in each cell of 2, 4, 8 and 16 pixels' edge: its mean color, its inverse
// depth, and the part of the cell that shows it. The gather fills occluded surfaces from them. One
// thread per block.
//
//   color, surfaces -> background_color, background_depth   12 blocks.x by 8 blocks.y (cells.glsl)
//
// LAYERS: defined if the frame has extra layers -> background_layers. Work groups z of 1 and more average
// layer z - 1.
#include "common/work_group.glsl"

#include "inverse_warp/cells.glsl"
#include "inverse_warp/surface.glsl"
#include "inverse_warp/wide_color.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform image2D background_color;
layout(binding = 1) writeonly uniform image2D background_depth;
#ifdef LAYERS
layout(binding = 2) uniform sampler2DArray layers;
layout(binding = 2) writeonly uniform image2DArray background_layers;
#endif

const float kEdgeWeight = 0.25;  // of an edge pixel: its color is mixed with the nearer surface's

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
    const Surface s = unpack_surface(texelFetch(surfaces, at, 0));
    return Cell(c, s.inverse_depth, s.edge ? kEdgeWeight : 1.0);
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

void main() {
    const ivec2 block = invocation_at();
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    Cell of_16 = empty();
    for (int i = 0; i < 4; ++i) {
        const ivec2 at_8 = 2 * block + ivec2(i & 1, i >> 1);
        Cell of_8 = empty();
        for (int j = 0; j < 4; ++j) {
            const ivec2 at_4 = 2 * at_8 + ivec2(j & 1, j >> 1);
            Cell of_4 = empty();
            for (int k = 0; k < 4; ++k) {
                const ivec2 at_2 = 2 * at_4 + ivec2(k & 1, k >> 1);
                Cell of_2 = pixel(2 * at_2);
                of_2 = merge(of_2, pixel(2 * at_2 + ivec2(1, 0)));
                of_2 = merge(of_2, pixel(2 * at_2 + ivec2(0, 1)));
                of_2 = merge(of_2, pixel(2 * at_2 + ivec2(1, 1)));
                store(of_2, at_2, 4.0);
                of_4 = merge(of_4, of_2);
            }
            store(of_4, first_of_4() + at_4, 16.0);
            of_8 = merge(of_8, of_4);
        }
        store(of_8, first_of_8() + at_8, 64.0);
        of_16 = merge(of_16, of_8);
    }
    store(of_16, first_of_16() + block, 256.0);
}
