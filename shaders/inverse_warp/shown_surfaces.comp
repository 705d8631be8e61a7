#version 450 core
// Each pixel gets the surface that it shows (bright_edges.comp), also if the adjacent pixel of that
// surface shows another in turn, and an edge to the adjacent pixels that show another.
//
//   surfaces_of_planes, shown -> surfaces
//
// NEIGHBOR: of the frame before or after. What this frame hides is never found if the light has
// changed around it: surfaces of this frame, light -> surfaces
#include "common/work_group.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D surfaces_of_planes;
layout(binding = 1) uniform usampler2D shown;
layout(binding = 0) writeonly uniform uimage2D surfaces;
#if NEIGHBOR
layout(binding = 2) uniform usampler2D surfaces_here;
layout(binding = 3) uniform sampler2D light;

#include "inverse_warp/light.glsl"

const int kRings = 2;                  // of cells, around that of a pixel
const float kLeastDifference = 0.004;  // squared

// Does this frame hide surface s, seen at p, and does the light around it differ from this frame's?
// That is, in the cells around that show it, of the smallest ring that has some, the brightness
// differs by more than its deviation there: a fill from this frame errs less.
bool has_other_light(ivec2 p, Surface s) {
    ivec2 here;
    if (s.inverse_depth < 0.0 || shown_here(surfaces_here, s, p, here)) return false;
    const ivec2 cell = p / kLightCellPx;
    const ivec2 last = (uniforms.size - 1) / kLightCellPx;
    precise float count = 0.0, mean = 0.0, square = 0.0, difference = 0.0;
    int ring = 0;
    ivec2 offset = ivec2(0);
    // One loop over the cells of all rings; it ends after the first ring that shows the surface.
    do {
        const ivec2 at = cell + offset;
        const bool within = all(greaterThanEqual(at, ivec2(0))) && all(lessThanEqual(at, last));
        const vec4 l = texelFetch(light, clamp(at, ivec2(0), last), 0);
        if (within && l.x >= 0.0 && one_depth(l.x, s.inverse_depth)) {
            count += 1.0;
            mean += l.y;
            square += l.w;
            difference += (l.z - l.y) * (l.z - l.y);
        }
        // Between the left and the right column of a ring only its first and last row.
        offset.x += abs(offset.y) == ring || ring == 0 ? 1 : 2 * ring;
        if (offset.x > ring) offset = ivec2(-ring, offset.y + 1);
        if (offset.y > ring && count == 0.0) {
            ++ring;
            offset = ivec2(-ring);
        }
    } while (offset.y <= ring && ring <= kRings);
    if (count == 0.0) return false;
    mean /= count;
    precise const float variance = max(square / count - mean * mean, 0.0);
    return difference / count > variance + kLeastDifference;
}
#endif

// The surface shown at p; `changed`: it is not the pixel's own.
Surface shown_at(ivec2 p, out bool changed) {
    const uint from = texelFetch(shown, p, 0).x;
    changed = from != 0u;
    ivec2 at = p;
    if (changed) {
        at += kAround[from - 1u];
        const uint next = texelFetch(shown, at, 0).x;
        if (next != 0u) at += kAround[next - 1u];
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
#if NEIGHBOR
    if (has_other_light(p, s)) s.inverse_depth = kNotThere;
#endif
    imageStore(surfaces, p, pack_surface(s));
}
