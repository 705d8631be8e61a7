// Numbers that are safe to filter and to store.

// False for NaN and infinities; by bits, because compilers may assume there are none.
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }
bool is_finite(vec4 c) {
    return is_finite(c.x) && is_finite(c.y) && is_finite(c.z) && is_finite(c.w);
}

// Half storage holds at most 65504: a larger value saturates there instead of becoming infinite
// and spreading over a whole kernel.
vec4 storable(vec4 c) {
#ifdef HALF_STORAGE
    const vec4 limit = vec4(65504.0);
    c = mix(c, limit, greaterThan(c, limit));
    return mix(c, -limit, lessThan(c, -limit));  // NaN stays NaN
#else
    return c;
#endif
}
