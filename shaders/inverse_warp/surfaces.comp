#version 450 core
// Packs motion and depth of each pixel.
//
//   inverse_depth [, motion [, motion_back [, both of the neighbors]]] -> surfaces
//                                            -> marks   of squares: the lower 16 bits: pixels at a
//                                                       depth edge
//
// NEIGHBOR: of the frame before or after. Also: surfaces of this frame -> upper 16 bits of `marks`:
// pixels that this frame hides
#define DENSE
#include "common/software_loop.glsl"

#include "inverse_warp/planes.glsl"

#include "inverse_warp/half.glsl"
#include "inverse_warp/square.glsl"

layout(binding = 0) writeonly uniform uimage2D surfaces;
layout(binding = 1) writeonly uniform uimage2D marks;
#if NEIGHBOR
layout(binding = 3) uniform usampler2D surfaces_here;

#include "inverse_warp/light.glsl"
#endif

vec4 row_of_depths(ivec2 first) {
    return vec4(depth_at(nearest_inside(first)), depth_at(nearest_inside(first + ivec2(1, 0))),
                depth_at(nearest_inside(first + ivec2(2, 0))),
                depth_at(nearest_inside(first + ivec2(3, 0))));
}

bvec4 jumps(vec4 q, vec4 r) {
    return bvec4(ivec4(greaterThan(q, kOneDepth * r)) | ivec4(greaterThan(r, kOneDepth * q)));
}

// Stores the surface. Its bit if the pixel is one that this frame hides.
uint store(ivec2 p, Surface s) {
    bool hidden = false;
#if NEIGHBOR
    const uvec4 bits = pack_of_neighbor(surfaces_here, s, p, hidden);
#else
    const uvec4 bits = pack_surface(s);
#endif
    imageStore(surfaces, in_half(p), bits);
    return hidden ? bit_of(p) : 0u;
}

// Stores the surfaces of a square, but those at an edge if they have motion. Bits of the pixels at an
// edge, and in the upper 16 of those that are hidden.
uint pack_square(ivec2 square) {
    const ivec2 first = kSquarePx * square;
    uint edges = 0u, hidden = 0u;
    vec4 above = row_of_depths(first - ivec2(0, 1)), own = row_of_depths(first);
    int y = 0;
    SOFTWARE_LOOP do {
        const ivec2 row = first + ivec2(0, y);
        const vec4 below = row_of_depths(row + ivec2(0, 1));
        const vec4 left = vec4(depth_at(nearest_inside(row - ivec2(1, 0))), own.xyz);
        const vec4 right = vec4(own.yzw, depth_at(nearest_inside(row + ivec2(4, 0))));
        const ivec4 jump = ivec4(jumps(own, left)) | ivec4(jumps(own, right)) |
                           ivec4(jumps(own, above)) | ivec4(jumps(own, below));
        const uint edges_of_row = uint(jump.x | jump.y << 1 | jump.z << 2 | jump.w << 3);
        edges |= edges_of_row << (4 * y);
        above = own;
        for (int x = 0; x < kSquarePx; ++x) {
            const ivec2 p = row + ivec2(x, 0);
            const bool edge = (edges_of_row >> x & 1u) != 0u;
            const float q = own.x;
            own = own.yzwx;
            if (inside(p) && !(edge && MOTION == 1))
                hidden |= store(p, surface_of(p, q, edge, motion_at(p)));
        }
        own = below;
    } while (++y < kSquarePx);
    // A square at the frame's border counts only with its pixels inside.
    const ivec2 extent = min(uniforms.size - first, ivec2(kSquarePx));
    edges &= (0x1111u * ((1u << extent.x) - 1u)) & ((1u << (4 * extent.y)) - 1u);
    return edges | hidden << 16;
}

#if MOTION
#if NEIGHBOR
shared uint hidden_of_square[kSquares];
#endif

// Stores the surfaces at edges. Bits of those of the square that are hidden.
uint pack_edges(int k, uint edges) {
#if NEIGHBOR
    hidden_of_square[k] = 0u;
#endif
    begin_list();
    add_to_list(k, edges);
    barrier();
    const int end = int(list_length);
    int i = k;
    if (i < end) SOFTWARE_LOOP do {
        const uint item = list[i];
        const ivec2 p = pixel_of(item);
        const uint hidden = store(p, surface_at(p));
#if NEIGHBOR
        atomicOr(hidden_of_square[square_of_item(item)], hidden);
#endif
    } while ((i += kThreads) < end);
#if NEIGHBOR
    barrier();
    return hidden_of_square[k];
#else
    return 0u;
#endif
}
#else
uint pack_edges(int k, uint edges) {
    return 0u;
}
#endif

void main() {
    const int k = int(gl_LocalInvocationIndex);
    const ivec2 square = square_of(k);
    uint marked = 0u;
    if (is_square(square)) marked = pack_square(square);
    marked |= pack_edges(k, marked & 0xffffu) << 16;
    if (is_square(square)) imageStore(marks, square, uvec4(marked));
}
