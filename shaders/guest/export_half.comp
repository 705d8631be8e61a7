#version 450 core
// Writes color that was filtered at half resolution to the host's texture, with the detail of the
// full resolution where nothing is blurred (PC_HALF_RESOLUTION):
//
//   out = up(filtered) + sharpness (color - up(unfiltered))
//
// up() interpolates. `sharpness` is a layer that began as layer_start.comp makes it.
// ARRAYS: which of the host's textures are arrays
#include "common/precise.glsl"
#include "guest/place.glsl"

layout(binding = 0) uniform sampler2D filtered;
layout(binding = 1) uniform sampler2D unfiltered;
layout(binding = 2) uniform sampler2DArray sharpness;
#if ARRAYS & GUEST_ARRAY_COLOR
layout(binding = 4) uniform sampler2DArray host_color;
#define COLOR_TEXEL(at) texelFetch(host_color, ivec3(at, uniforms.slices.x), uniforms.levels.x)
#else
layout(binding = 4) uniform sampler2D host_color;
#define COLOR_TEXEL(at) texelFetch(host_color, at, uniforms.levels.x)
#endif
layout(binding = 0) writeonly uniform image2D host_output;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.full_size))) return;
    // The pixel's center is a quarter of a texel away from that of its own one.
    const ivec2 own = p / 2, toward = 2 * (p & 1) - 1, last = uniforms.size - 1;
    precise vec4 up_filtered = vec4(0.0), up_unfiltered = vec4(0.0);
    precise float sharp = 0.0;
    for (int i = 0; i < 4; ++i) {
        const ivec2 step = ivec2(i & 1, i >> 1);
        const ivec2 q = clamp(own + step * toward, ivec2(0), last);
        const float weight = (step.x == 0 ? 0.75 : 0.25) * (step.y == 0 ? 0.75 : 0.25);
        up_filtered += weight * texelFetch(filtered, q, 0);
        up_unfiltered += weight * texelFetch(unfiltered, q, 0);
        const float start = ((q.x + q.y) & 1) == 0 ? 1.0 : -1.0;
        sharp += weight * clamp(start * texelFetch(sharpness, ivec3(q, 0), 0).x, 0.0, 1.0);
    }
    vec4 color = finite_color(COLOR_TEXEL(stored_at(p, uniforms.color_at)));
    color.rgb *= gain();
    color = finite_color(color);
    precise vec4 result = up_filtered + sharp * (color - up_unfiltered);
    // Detail added to blur must not lead beyond both: below 0, or above an alpha of 1.
    const vec4 least = min(vec4(0.0), min(color, up_filtered));
    result = max(result, least);
    result.a = min(result.a, max(1.0, max(color.a, up_filtered.a)));
    result.rgb /= gain();
    result = clamp(result, -uniforms.output_max, uniforms.output_max);
    imageStore(host_output, stored_at(p, uniforms.output_at), result);
}
