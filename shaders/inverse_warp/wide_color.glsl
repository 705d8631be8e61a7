// Color, and the extra layers that are filtered with it: with color's weights, which are found once.
// A wide texture is a texture and the array of its layers, and each of these is a plane of it.
//
// LAYERS: defined if the frame has extra layers, however many
#include "common/finite.glsl"
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

const float kSharpening = 2.0;  // of bilinear weights about their center: half the added blur

// Color of the surface that is seen at the position `at`, pixels: bilinear, with sharpened weights.
vec4 color_at(WIDE_SAMPLER(color, layers), Plane plane, vec2 at) {
    const vec2 base = floor(at);
    const vec2 f = clamp(kSharpening * (at - base - 0.5) + 0.5, 0.0, 1.0);
    const vec2 filtered_at = (base + f + 0.5) / vec2(uniforms.size);
#ifdef LAYERS
    if (!plane.is_color) return textureLod(layers, vec3(filtered_at, float(plane.layer)), 0.0);
#endif
    vec4 c = textureLod(color, filtered_at, 0.0);
    // The sampler may have mixed a value that passes do not read: then by hand.
    if (!is_readable(c)) {
        c = vec4(0.0);
        int i = 0;
        do {
            const vec2 corner = vec2(i & 1, i >> 1);
            const ivec2 p = min(ivec2(base + corner), uniforms.size - 1);
            const vec2 w = mix(1.0 - f, f, corner);
            c += w.x * w.y * fetch(WIDE(color, layers), plane, p);
            ++i;
        } while (i < 4);
    }
    return c;
}
