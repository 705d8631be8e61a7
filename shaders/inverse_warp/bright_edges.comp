#version 450 core
// The surface of bright pixels at edges. Antialiasing mixes the light of a lamp into pixels that have
// the depth of what is behind it, or before it. Displaced with that surface the light would become a
// rim, or a glow: such a pixel gets the lamp's surface.
//
//   color, surfaces_of_planes -> surfaces
#include "common/finite.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces_of_planes;
layout(binding = 0) writeonly uniform uimage2D surfaces;

// A pixel shows the light of another surface where it is so many times as bright as its own surface
// around it, the other next to it is so many times as bright as the pixel, and as what is around.
const float kBrighter = 4.0, kOtherBrighter = 1.1, kLampBrighter = 20.0;
// And where the two are displaced differently by so much. What stays where it is, up to this, keeps
// the light of what is behind it: that is seen through the edge.
const float kApartPx = 1.0, kStaysPx = 3.0;
const int kReachPx = 2;

const ivec2 kAround[4] = ivec2[4](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

float largest(vec4 c) {
    return max(c.r, max(c.g, c.b));
}

bool inside(ivec2 p) {
    return all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, block.size));
}

Surface surface_at(ivec2 p) {
    return unpack_surface(texelFetch(surfaces_of_planes, p, 0));
}

// Largest component of the mean color of a surface in the smallest square around p that shows it
// away from edges; `otherwise` where none does.
float light_around(ivec2 p, Surface own, float otherwise) {
    for (int reach = 1; reach <= kReachPx; ++reach) {
        vec4 sum = vec4(0.0);
        float count = 0.0;
        for (int y = -reach; y <= reach; ++y) {
            for (int x = -reach; x <= reach; ++x) {
                const ivec2 at = p + ivec2(x, y);
                if (!inside(at)) continue;
                const Surface s = surface_at(at);
                if (s.edge || !one_depth(s.inverse_depth, own.inverse_depth)) continue;
                const vec4 c = texelFetch(color, at, 0);
                if (!is_finite(c)) continue;
                sum += c;
                count += 1.0;
            }
        }
        if (count > 0.0) return largest(sum) / count;
    }
    return otherwise;
}

// The pixel whose surface p shows: p, or one next to it.
ivec2 shown_at(ivec2 p) {
    const Surface own = surface_at(p);
    const vec4 c = texelFetch(color, p, 0);
    const float light = largest(c);
    if (!own.edge || !is_finite(c) || !(light > 0.0)) return p;
    ivec2 brightest = p;
    float other_light = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 at = p + kAround[i];
        if (!inside(at) || one_depth(surface_at(at).inverse_depth, own.inverse_depth)) continue;
        const vec4 other = texelFetch(color, at, 0);
        if (!is_finite(other) || largest(other) <= other_light) continue;
        other_light = largest(other);
        brightest = at;
    }
    if (!(other_light > kOtherBrighter * light)) return p;
    const Surface other = surface_at(brightest);
    const bool behind = other.inverse_depth < own.inverse_depth;
    if (apart(other, own) <= kApartPx * kApartPx || (behind && longest_of(own) <= kStaysPx)) return p;
    const float around = light_around(p, own, light);
    return light > kBrighter * around && other_light > kLampBrighter * around ? brightest : p;
}

// Does a pixel next to this one show another surface than it has?
bool edge_at(ivec2 p, Surface own) {
    for (int i = 0; i < 4; ++i) {
        const ivec2 at = p + kAround[i];
        if (!inside(at)) continue;
        const ivec2 shown = shown_at(at);
        if (shown != at && !one_depth(surface_at(shown).inverse_depth, own.inverse_depth)) return true;
    }
    return false;
}

void main() {
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(p)) return;
    Surface s = surface_at(shown_at(p));
    s.edge = s.edge || edge_at(p, s);
    imageStore(surfaces, p, pack_surface(s));
}
