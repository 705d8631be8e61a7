#version 450 core
// The surface of bright pixels at edges. Antialiasing mixes the light of a lamp into pixels that
// have the depth of the surface behind it or before it. If the light moved with that surface, it
// would form a rim or a glow: such a pixel shows the lamp's surface.
//
//   color, surfaces_of_planes -> shown   0: the pixel's own surface; i + 1: that of the pixel at
//                                        the offset kAround[i] (around.glsl)
#include "common/finite.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces_of_planes;
layout(binding = 0) writeonly uniform uimage2D shown;

// A pixel shows the light of an adjacent surface if the pixel is kBrighter times as bright as its
// own surface around it, the other surface is kOtherBrighter times as bright as the pixel, and
// kLampBrighter times as bright as the surface around. A pixel with less than kCovered of a surface
// behind it goes on hiding that surface.
const float kBrighter = 4.0, kOtherBrighter = 1.1, kLampBrighter = 10.0, kCovered = 0.1;
// And if the two are displaced differently by more than kApartPx. A surface that is displaced by at
// most kStaysPx keeps the light of a surface behind it, which is seen through the edge.
const float kApartPx = 1.0, kStaysPx = 3.0;
// Before a surface that stays, one that leaves it by more than kLeavesPx would leave a rim in its
// place. Less light counts there: times as bright as the surface around, as above.
const float kLeavesPx = 10.0, kRimBrighter = 1.5, kRimOtherBrighter = 2.5;
const int kReachPx = 2;

float largest(vec4 c) {
    return max(c.r, max(c.g, c.b));
}

Surface surface_at(ivec2 p) {
    return unpack_surface(texelFetch(surfaces_of_planes, p, 0));
}

// Largest component of the mean color of a surface in the smallest square around p that shows it
// away from edges; if none does, of its darkest pixel there.
float light_around(ivec2 p, Surface own) {
    precise vec4 sum = vec4(0.0);
    precise float count = 0.0;
    float darkest = 3.4e38;
    // One loop over the pixels of both squares; it ends after the first square that shows some.
    ivec2 offset = ivec2(-1);
    int reach = 1;
    do {
        const ivec2 at = p + offset;
        const ivec2 read = clamp(at, ivec2(0), uniforms.size - 1);
        const Surface s = surface_at(read);
        const vec4 c = finite_color(texelFetch(color, read, 0));
        const bool same = at == read && one_depth(s.inverse_depth, own.inverse_depth);
        if (same) darkest = min(darkest, largest(c));
        if (same && !s.edge) {
            sum += c;
            count += 1.0;
        }
        ++offset.x;
        if (offset.x > reach) offset = ivec2(-reach, offset.y + 1);
        if (offset.y > reach && count == 0.0) {
            ++reach;
            offset = ivec2(-reach);
        }
    } while (offset.y <= reach && reach <= kReachPx);
    return count > 0.0 ? largest(sum) / count : darkest;
}

uint shown_at(ivec2 p) {
    const Surface own = surface_at(p);
    const vec4 c = finite_color(texelFetch(color, p, 0));
    const float light = largest(c);
    if (!own.edge || !(light > 0.0)) return 0u;
    uint brightest = 0u;
    float other_light = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 at = p + kAround[i];
        if (!inside(at) || one_depth(surface_at(at).inverse_depth, own.inverse_depth)) continue;
        const vec4 other = finite_color(texelFetch(color, at, 0));
        if (largest(other) <= other_light) continue;
        other_light = largest(other);
        brightest = uint(i) + 1u;
    }
    if (brightest == 0u || other_light <= kOtherBrighter * light) return 0u;
    const Surface other = surface_at(p + kAround[brightest - 1u]);
    if (apart(other, own) <= kApartPx * kApartPx) return 0u;
    const bool hides = own.inverse_depth > other.inverse_depth;
    const bool stays = longest_of(own) <= kStaysPx;
    if (hides && stays) return 0u;
    const bool rim = stays && apart(other, own) > kLeavesPx * kLeavesPx;
    const float around = light_around(p, own);
    if (light <= (rim ? kRimBrighter : kBrighter) * around ||
        other_light <= (rim ? kRimOtherBrighter : kLampBrighter) * around)
        return 0u;
    precise const float covered = (light - around) / (other_light - around);
    return hides && covered < kCovered ? 0u : brightest;
}

void main() {
    const ivec2 p = invocation_at();
    if (inside(p)) imageStore(shown, p, uvec4(shown_at(p)));
}
