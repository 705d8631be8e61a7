#version 450 core
// Each pixel gets the surface that it shows (bright_edges.comp), also if the adjacent pixel of that
// surface shows another in turn, and an edge to the adjacent pixels that show another.
//
//   surfaces_of_planes, shown -> surfaces
#include "common/work_group.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D surfaces_of_planes;
layout(binding = 1) uniform usampler2D shown;
layout(binding = 0) writeonly uniform uimage2D surfaces;

// The surface shown at p; `changed`: it is not the pixel's own.
Surface shown_at(ivec2 p, out bool changed) {
    uint from = texelFetch(shown, p, 0).x;
    changed = from != 0u;
    ivec2 at = p;
    for (int i = 0; i < 2 && from != 0u; ++i) {
        at += kAround[from - 1u];
        if (i == 0) from = texelFetch(shown, at, 0).x;
    }
    return unpack_surface(texelFetch(surfaces_of_planes, at, 0));
}

void main() {
    const ivec2 p = invocation_at();
    if (!inside(p)) return;
    bool changed;
    Surface s = shown_at(p, changed);
    for (int i = 0; i < 4; ++i) {
        const ivec2 at = p + kAround[i];
        if (!inside(at)) continue;
        const Surface other = shown_at(at, changed);
        s.edge = s.edge || (changed && !one_depth(other.inverse_depth, s.inverse_depth));
    }
    imageStore(surfaces, p, pack_surface(s));
}
