// Color, and the extra layers that are filtered with it: with color's weights, which are found
// once. A wide texture is a texture and the array of its layers, and each of these is a plane of
// it.
//
// LAYERS: defined if the frame has extra layers, however many
#include "common/finite.glsl"
#include "shared/inverse_warp_constants.h"
#include "shared/inverse_warp_uniforms.h"

#ifdef LAYERS
#define WIDE(color, layers) color, layers
#define WIDE_SAMPLER(color, layers) sampler2D color, sampler2DArray layers
#else
#define WIDE(color, layers) color
#define WIDE_SAMPLER(color, layers) sampler2D color
#endif

struct Plane {
    bool is_color;
    int layer;
};

const Plane kColor = Plane(true, 0);

vec4 fetch(WIDE_SAMPLER(color, layers), Plane plane, ivec2 at) {
#ifdef LAYERS
    if (!plane.is_color) return texelFetch(layers, ivec3(at, plane.layer), 0);
#endif
    return finite_color(texelFetch(color, at, 0));
}

// Between a texel, those beside and below it, and the one across. By differences: equal texels give their
// value to the bit, and the first keeps its bits beside a brighter one if f is 0. Not an array of four:
// what `precise` arithmetic reads of an array, a GPU's compiler keeps in memory.
vec4 bilinear(vec4 texel, vec4 beside, vec4 below, vec4 across, vec2 f) {
    precise const vec4 upper = texel + f.x * (beside - texel);
    precise const vec4 lower = below + f.x * (across - below);
    precise const vec4 mean = upper + f.y * (lower - upper);
    return mean;
}

#ifndef SOFTWARE_RENDERER
// Does finite_color() leave all four texels as they are? The largest of them may lose a NaN, their mean keeps
// it, however small its weight.
bool are_colors(vec4 t, vec4 u, vec4 v, vec4 w, vec4 mean) {
    const vec4 largest = max(max(abs(t), abs(u)), max(abs(v), abs(w)));
    const float limit = max(max(largest.x, largest.y), max(largest.z, largest.w));
    precise const float sum = mean.x + mean.y + mean.z + mean.w;
    return limit <= kMaxColor && is_finite(sum);
}
#endif

// The pixel nearest to a position, the one across from it, and the weight of the latter along each axis.
struct Corners {
    ivec2 nearest, across;
    vec2 f;
};

Corners corners_of(vec2 at) {
    precise const vec2 nearest = floor(at + 0.5);
    const vec2 beyond = at - nearest;
    precise const vec2 f = max(kSharpening * (abs(beyond) - 0.5) + 0.5, 0.0);
    const ivec2 a = ivec2(nearest);
    const ivec2 step = ivec2(mix(vec2(1.0), vec2(-1.0), lessThan(beyond, vec2(0.0))));
    return Corners(a, min(a + step, uniforms.size - 1), f);
}

// Color of the surface that is seen at the position `at`, pixels: bilinear, with sharpened weights.
// Not by a sampler: devices round its weights to 8 bits.
vec4 color_at(WIDE_SAMPLER(color, layers), Plane plane, vec2 at) {
    const Corners corners = corners_of(at);
    const ivec2 a = corners.nearest, b = corners.across;
    const ivec2 beside = ivec2(b.x, a.y), below = ivec2(a.x, b.y);
#ifndef SOFTWARE_RENDERER
    // All four texels are checked together: hardly any needs finite_color().
    if (plane.is_color) {
        const vec4 t = texelFetch(color, a, 0), u = texelFetch(color, beside, 0),
                   v = texelFetch(color, below, 0), w = texelFetch(color, b, 0);
        const vec4 mean = bilinear(t, u, v, w, corners.f);
        if (are_colors(t, u, v, w, mean)) return mean;
    }
#endif
    return bilinear(fetch(WIDE(color, layers), plane, a), fetch(WIDE(color, layers), plane, beside),
                    fetch(WIDE(color, layers), plane, below), fetch(WIDE(color, layers), plane, b),
                    corners.f);
}
