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
