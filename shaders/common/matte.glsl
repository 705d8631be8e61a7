// A pass's matte at a pixel; of what lies around its object the color. Needs `mattes` declared after
// it: functions are macros where that is so. MATTE: index of the matte.

#define matte_at(p) matte_of(texelFetch(mattes, ivec3(p, MATTE), 0).x)

// NaN holds nothing out.
float matte_of(float stored) {
    return stored > 0.0 ? min(stored, 1.0) : 0.0;
}

// The same to the bit wherever it is computed.
vec4 without(vec4 c, float kept) {
    precise vec4 product = c * kept;
    return product;
}
