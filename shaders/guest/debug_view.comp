#version 450 core
// Draws one of a plan's textures over the whole frame.
//
//   VIEW 0  color, unchanged
//   VIEW 1  a number: black = 0, warm above, cool below
//   VIEW 2  a vector: hue = direction, brightness = length, white from kLongest on
//   VIEW 3  color in dark gray, as background for the blocks of a work list
//   VIEW 4  a block of a work list, bright
//   VIEW 5  the fill mask: red what is estimated, green what a neighbor shows
//
//   HOST 1  the texture is the host's, rows as it stores them; 2: an array
#include "guest/place.glsl"

#if VIEW == 5
layout(binding = 0) uniform sampler2DArray shown;
#define FETCH(at) texelFetch(shown, ivec3(at, 0), 0)
#elif HOST == 2
layout(binding = 0) uniform sampler2DArray shown;
#define FETCH(at) texelFetch(shown, ivec3(at, uniforms.shown_image.x), uniforms.shown_image.y)
#else
layout(binding = 0) uniform sampler2D shown;
#define FETCH(at) texelFetch(shown, at, uniforms.shown_image.y)
#endif
layout(binding = 0) writeonly uniform image2D host_output;

const float kLongest = 32.0;  // pixels

vec3 hue(float turn) {
    return clamp(abs(fract(turn + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

vec4 view_of(vec4 value) {
#if VIEW == 1
    const float size = abs(value.x) / (1.0 + abs(value.x));
    return vec4(value.x >= 0.0 ? vec3(1.0, 0.6, 0.2) * size : vec3(0.2, 0.5, 1.0) * size, 1.0);
#elif VIEW == 2
    const float size = length(value.xy) / kLongest;
    if (size == 0.0) return vec4(0.0, 0.0, 0.0, 1.0);
    const vec3 direction = hue(atan(value.y, value.x) / 6.28318530718);
    return vec4(mix(direction * min(sqrt(size), 1.0), vec3(1.0), clamp(size - 1.0, 0.0, 1.0)), 1.0);
#elif VIEW == 3
    const float gray = dot(clamp(value.rgb, 0.0, 1.0), vec3(0.2126, 0.7152, 0.0722));
    return vec4(vec3(0.3 * gray), 1.0);
#elif VIEW == 4
    return vec4(0.9, 0.6, 0.1, 1.0);
#elif VIEW == 5
    return vec4(value.z, value.y, 0.0, 1.0);
#else
    return value;
#endif
}

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
#if HOST
    const ivec2 size = uniforms.shown_size;
    const ivec2 at = stored_at(texel_of(p, size), uniforms.shown_at, size);
#else
    const ivec2 at = min(p * uniforms.shown_size / uniforms.size, uniforms.shown_size - 1);
#endif
    imageStore(host_output, stored_at(p, uniforms.output_at), view_of(FETCH(at)));
}
