// Detects NaN and infinities by their bits: a compiler may assume that there are none.
#include "shared/color_limits.h"

bool is_finite(float x) {
    return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}

bool is_finite(vec4 v) {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z) && is_finite(v.w);
}

// The color of a texel as passes read it (shared/color_limits.h). A GPU skips what hardly any texel needs, and
// checks all components together: the largest one may lose a NaN, their sum keeps it.
vec4 finite_color(vec4 texel) {
#ifndef SOFTWARE_RENDERER
    const vec4 magnitude = abs(texel);
    const float largest = max(max(magnitude.x, magnitude.y), max(magnitude.z, magnitude.w));
    precise const float sum = texel.x + texel.y + texel.z + texel.w;
    if (largest <= kMaxColor && is_finite(sum)) return texel;
#endif
    const uvec4 bits = floatBitsToUint(texel);
    const uvec4 size = bits & 0x7fffffffu;
    const vec4 limit = uintBitsToFloat((bits & 0x80000000u) | floatBitsToUint(kMaxHalf));
    const vec4 limited = mix(texel, limit, greaterThan(size, uvec4(floatBitsToUint(kMaxColor))));
    return mix(limited, vec4(0.0), greaterThan(size, uvec4(0x7f800000u)));
}
