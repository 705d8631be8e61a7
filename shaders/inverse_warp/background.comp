#version 450 core
// What lies farthest: for cells of 2, 4, 8 and 16 pixels' edge the mean color of the farthest surface
// in each, its inverse depth, and what part of the cell it is. The gather takes from them what is
// hidden behind nearer surfaces. One thread for a tile.
//
//   color, surfaces -> background_color, background_depth   15 tiles.x by 8 tiles.y: the cells of
//                      2 px, to the right of them those of 4, 8 and 16 px (background.glsl)
//
// LAYERS: so many further layers too -> background_layers
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform image2D background_color;
layout(binding = 1) writeonly uniform image2D background_depth;
#ifdef LAYERS
layout(binding = 2) uniform sampler2DArray layers;
layout(binding = 2) writeonly uniform image2DArray background_layers;
#endif

// Of a pixel at an edge: its color is mixed with that of the nearer surface.
const float kEdgeWeight = 0.25;

struct Cell {
    vec4 color;
    float inverse_depth;
    float weight;  // pixels; 0: nothing
#ifdef LAYERS
    vec4 layers[LAYERS];
#endif
};

Cell nothing() {
    Cell cell;
    cell.color = vec4(0.0);
    cell.inverse_depth = 0.0;
    cell.weight = 0.0;
#ifdef LAYERS
    FOR_LAYERS(i) cell.layers[i] = vec4(0.0);
#endif
    return cell;
}

// The farther one, or both where they are one surface.
Cell merge(Cell a, Cell b) {
    if (a.weight == 0.0) return b;
    if (b.weight == 0.0) return a;
    if (!one_depth(a.inverse_depth, b.inverse_depth))
        return a.inverse_depth < b.inverse_depth ? a : b;
    const float weight = a.weight + b.weight;
    // By the difference: one color stays to the bit.
    Cell both;
    both.color = a.color + (b.weight / weight) * (b.color - a.color);
    both.inverse_depth = min(a.inverse_depth, b.inverse_depth);
    both.weight = weight;
#ifdef LAYERS
    FOR_LAYERS(i)
        both.layers[i] = a.layers[i] + (b.weight / weight) * (b.layers[i] - a.layers[i]);
#endif
    return both;
}

Cell pixel(ivec2 at) {
    if (any(greaterThanEqual(at, uniforms.size))) return nothing();
    const vec4 c = texelFetch(color, at, 0);
    if (!is_finite(c)) return nothing();
    const Surface s = unpack_surface(texelFetch(surfaces, at, 0));
    Cell cell;
    cell.color = c;
    cell.inverse_depth = s.inverse_depth;
    cell.weight = s.edge ? kEdgeWeight : 1.0;
#ifdef LAYERS
    FOR_LAYERS(i) cell.layers[i] = LAYER_FETCH(layers, at, i);
#endif
    return cell;
}

// `left`: column of the first cell of this size, in tiles.
void store(Cell cell, ivec2 at, int left, float pixels) {
    at.x += left * uniforms.tiles.x;
    STORE(background_color, at, cell.color);
    STORE(background_depth, at, vec4(cell.inverse_depth, cell.weight / pixels, 0.0, 0.0));
#ifdef LAYERS
    FOR_LAYERS(i) LAYER_STORE(background_layers, at, i, cell.layers[i]);
#endif
}

void main() {
    const ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, uniforms.tiles))) return;
    Cell of_16 = nothing();
    for (int i = 0; i < 4; ++i) {
        const ivec2 at_8 = 2 * tile + ivec2(i & 1, i >> 1);
        Cell of_8 = nothing();
        for (int j = 0; j < 4; ++j) {
            const ivec2 at_4 = 2 * at_8 + ivec2(j & 1, j >> 1);
            Cell of_4 = nothing();
            for (int k = 0; k < 4; ++k) {
                const ivec2 at_2 = 2 * at_4 + ivec2(k & 1, k >> 1);
                Cell of_2 = pixel(2 * at_2);
                of_2 = merge(of_2, pixel(2 * at_2 + ivec2(1, 0)));
                of_2 = merge(of_2, pixel(2 * at_2 + ivec2(0, 1)));
                of_2 = merge(of_2, pixel(2 * at_2 + ivec2(1, 1)));
                store(of_2, at_2, 0, 4.0);
                of_4 = merge(of_4, of_2);
            }
            store(of_4, at_4, 8, 16.0);
            of_8 = merge(of_8, of_4);
        }
        store(of_8, at_8, 12, 64.0);
        of_16 = merge(of_16, of_8);
    }
    store(of_16, tile, 14, 256.0);
}
