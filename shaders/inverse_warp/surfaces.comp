#version 450 core
// Packs motion and depth of each pixel.
//
//   inverse_depth [, motion [, motion_back]] -> surfaces
//                                            -> marks   of squares: the lower 16 bits: pixels at a
//                                                       depth edge
//
// NEIGHBOR: of the frame before or after. Also: surfaces of this frame -> upper 16 bits of `marks`:
// pixels that this frame hides
#include "inverse_warp/planes.glsl"
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
    const uvec4 bits = pack_surface(s);
    imageStore(surfaces, p, bits);
#if NEIGHBOR
    if (is_hidden(surfaces_here, unpack_surface(bits), p)) return bit_of(p);
#endif
    return 0u;
}

void main() {
    const ivec2 square = invocation_at(), first = kSquarePx * square;
    if (!is_square(square)) return;
    uint edges = 0u, hidden = 0u;
    vec4 above = row_of_depths(first - ivec2(0, 1)), own = row_of_depths(first);
    for (int y = 0; y < kSquarePx; ++y) {
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
            // Those at an edge follow below.
            if (inside(p) && !(edge && MOTION == 1))
                hidden |= store(p, surface_of(q, edge, motion_at(p)));
        }
        own = below;
    }
    // Of a square at the frame's border, only the pixels inside.
    const ivec2 extent = min(uniforms.size - first, ivec2(kSquarePx));
    edges &= (0x1111u * ((1u << extent.x) - 1u)) & ((1u << (4 * extent.y)) - 1u);
#if MOTION
    for (uint left = edges; left != 0u;) {
        const ivec2 p = next_pixel_of(square, left);
        hidden |= store(p, surface_at(p));
    }
#endif
    imageStore(marks, square, uvec4(edges | hidden << 16));
}
