#version 450 core
// out = mix(sharp, bilinear(low), smoothstep(0.5, full_blur_px, |R|)), where low is the blurred
// copy at 1/FACTOR of the size. Where the weight is 0 the pixel returns bit for bit.
// WITH_HINT: FXAA's hint, multiplied by clamp(1 - |R|, 0, 1): what it marks is blurred away.
#include "shared/depth_of_field_block.h"
#include "depth_of_field/storable.glsl"

layout(local_size_x = 16, local_size_y = 16) in;
layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D coc;
layout(binding = 2) uniform sampler2D low;
layout(binding = 0) writeonly uniform image2D result;
#ifdef WITH_HINT
layout(binding = 3) uniform sampler2D hint;
layout(binding = 1) writeonly uniform image2D hint_result;
#endif

// a + t (b - a) and not mix(): exact when a and b are equal.
vec4 between(vec4 a, vec4 b, float t) { return a + t * (b - a); }

// Bilinear by hand at (p + 0.5)/FACTOR - 0.5, clamped: hardware filtering rounds its weights to
// 8 bits.
vec4 fetch_low(ivec2 p) {
#if FACTOR == 1
    return texelFetch(low, p, 0);
#else
    vec2 position = max((vec2(p) + 0.5) / float(FACTOR) - 0.5, 0.0);
    ivec2 a = ivec2(position);  // at most low_size - 1; beyond the last centre a = b
    ivec2 b = min(a + 1, block.low_size - 1);
    vec2 t = position - vec2(a);
    vec4 top = between(texelFetch(low, a, 0), texelFetch(low, ivec2(b.x, a.y), 0), t.x);
    vec4 bottom = between(texelFetch(low, ivec2(a.x, b.y), 0), texelFetch(low, b, 0), t.x);
    return between(top, bottom, t.y);
#endif
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, block.size))) return;
    vec4 sharp = texelFetch(color, p, 0);
    float radius = abs(texelFetch(coc, p, 0).x);
    vec4 c = sharp;
    if (radius > 0.5) {
        float t = clamp((radius - 0.5) / (block.full_blur_px - 0.5), 0.0, 1.0);
        vec4 blurred = fetch_low(p);
        // A pixel without a finite colour has nothing to mix: the blurred copy stands for it.
        c = is_finite(sharp) ? between(sharp, blurred, t * t * (3.0 - 2.0 * t)) : blurred;
    }
    imageStore(result, p, storable(c));
#ifdef WITH_HINT
    vec2 gate = texelFetch(hint, p, 0).xy * clamp(1.0 - radius, 0.0, 1.0);
    imageStore(hint_result, p, vec4(gate, 0.0, 0.0));
#endif
}
