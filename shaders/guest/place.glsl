// Maps a pixel of the canonical frame (row 0 at the top) to a texel of a host's texture.
#include "common/finite.glsl"
#include "common/work_list.glsl"
#include "shared/guest_uniforms.h"

ivec2 stored_at(ivec2 p, ivec2 first, ivec2 size) {
    return first + ivec2(p.x, uniforms.bottom_up != 0 ? size.y - 1 - p.y : p.y);
}

ivec2 stored_at(ivec2 p, ivec2 first) {
    return stored_at(p, first, uniforms.size);
}

// The texel with the pixel's center, in a plane of another size.
ivec2 texel_of(ivec2 p, ivec2 size) {
    return size == uniforms.size ? p : (2 * p + 1) * size / (2 * uniforms.size);
}

#if EXPOSURE
layout(binding = 3) uniform sampler2D exposure;
#endif

// Factor from the host's color to the color that passes read. An invalid exposure counts as 1.
float gain() {
#if EXPOSURE
    const float value = texelFetch(exposure, uniforms.exposure_at, 0).x;
    if (is_finite(value) && value > 0.0) return uniforms.gain * value;
#endif
    return uniforms.gain;
}
