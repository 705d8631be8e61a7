#version 450 core
// Pixels that mix two surfaces get the place of their color, or the surface in front. Beside one that gets the
// surface in front, pixels of the other surface are marked as edges that show their own color.
//
//   surfaces, marks, shown, mixed -> surfaces
#include "common/software_loop.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"

#include "inverse_warp/mixture.glsl"
#include "inverse_warp/split_edges.glsl"

layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 4) uniform usampler2D mixed;
layout(binding = 0) writeonly uniform uimage2D split;

// No thread stores a pixel here that is at an edge already, so all that store one store the same.
void mark_edges_beside(ivec2 p, Surface taken) {
    uint left = 15u;
    SOFTWARE_LOOP do {
        const ivec2 at = clamp(p + kAround[findLSB(left)], ivec2(0), uniforms.size - 1);
        const uvec4 bits = texelFetch(surfaces, at, 0);
        const Surface s = unpack_surface(bits);
        const bool becomes_edge = !s.edge && !one_depth(s.inverse_depth, taken.inverse_depth);
        if (becomes_edge) imageStore(split, at, with_place(bits, kOwnPlace));
        left &= left - 1u;
    } while (left != 0u);
}

void main() {
    const int first = int(gl_LocalInvocationIndex);
    list_edges();
    int i = first;
    const int end = int(list_length);
    if (i < end) SOFTWARE_LOOP do {
        const ivec2 p = pixel_of(list[i]);
        const uint word = texelFetch(mixed, p, 0).x, place = word & 31u;
        const bool takes = (word & kTakes) != 0u, holds = (word & kHolds) != 0u;
        // A pixel whose surface is taken keeps it. If another thread has stored its place, that is replaced.
        const ivec2 at = p + (takes || holds ? offset_of(place) : ivec2(0));
        const ivec2 from = clamp(at, ivec2(0), uniforms.size - 1);
        const uvec4 bits = texelFetch(surfaces, from, 0);
        const uvec4 placed =
            holds ? with_front(bits, place, word >> kFrontShift & 31u, word >> kPartsShift)
                  : with_place(bits, takes ? kOwnPlace : place);
        if (word != 0u) imageStore(split, p, placed);
        if (takes) mark_edges_beside(p, unpack_surface(bits));
    } while ((i += kThreads) < end);
}
