// A pass's matte at a pixel, and the color around its object. Needs `mattes`, which is declared
// after it: functions that use it are macros. MATTE: index of the matte.

#define matte_at(p) matte_of(texelFetch(mattes, ivec3(p, MATTE), 0).x)

// NaN holds nothing out.
float matte_of(float stored) {
    return stored > 0.0 ? min(stored, 1.0) : 0.0;
}

// Equal bits in every shader that computes it.
vec4 without(vec4 c, float kept) {
    precise vec4 product = c * kept;
    return product;
}
