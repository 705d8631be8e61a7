// Detects NaN and infinities by their bits: a compiler may assume that there are none.

bool is_nan(float x) {
    return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u;
}

bool is_finite(float x) {
    return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}

bool is_finite(vec4 c) {
    return is_finite(c.x) && is_finite(c.y) && is_finite(c.z) && is_finite(c.w);
}
