#version 450 core
// Pixels that mix two surfaces get the place of their color, and the surface there if they take it.
//
//   surfaces, marks, shown, mixed -> surfaces
#include "common/software_loop.glsl"

#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"

#include "inverse_warp/mixture.glsl"
#include "inverse_warp/split_edges.glsl"

layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 4) uniform usampler2D mixed;
layout(binding = 0) writeonly uniform uimage2D split;

void main() {
    const int first = int(gl_LocalInvocationIndex);
    list_edges();
    int i = first;
    const int end = int(list_length);
    if (i < end) SOFTWARE_LOOP do {
        const ivec2 p = pixel_of(list[i]);
        const uint word = texelFetch(mixed, p, 0).x, place = word & 31u;
        const uint color_place = (word & kKeepsColor) != 0u ? kOwnPlace : place;
        // A pixel whose surface is taken keeps it. If another thread has stored its place, that is replaced.
        const ivec2 at = p + ((word & kTakes) != 0u ? offset_of(place) : ivec2(0));
        const ivec2 from = clamp(at, ivec2(0), uniforms.size - 1);
        if (word != 0u) imageStore(split, p, with_place(texelFetch(surfaces, from, 0), color_place));
    } while ((i += kThreads) < end);
}
