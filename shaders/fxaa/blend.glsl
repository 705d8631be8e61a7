// The lerp of two texels that ends every path of FXAA. Needs block.exposure; BLEND_TONEMAPPED.

#include "common/finite.glsl"

const float kLargestExposed = 1e30;

// From a (weight 0) to b (weight 1). Weight 0, equal texels or a texel that is not finite give a,
// bit for bit; finite texels give a finite result.
//
// BLEND_TONEMAPPED: T^-1(lerp(T(a), T(b), weight)) with T(x) = x/(1 + m), m = max(0, x.r, x.g,
// x.b) of the exposed color, T^-1(y) = y/(1 - max(0, y.r, y.g, y.b)). Written out with
// wa = (1 - weight)/(1 + ma), wb = weight/(1 + mb) this is
//
//   (wa a + wb b) / (wa + wb)  *  (wa + wb) / (wa + wb + deficit),
//   deficit = min over r, g, b and zero of  wa (ma - a_c) + wb (mb - b_c)  >= 0,
//
// a weighted mean, darkened when the two maxima are in different channels. Nothing cancels, and
// nothing overflows when both weights are scaled by min(1 + ma, 1 + mb).
// Alpha is coverage: lerped as it is, with the same two texels and the same weight.
vec4 blend(vec4 a, vec4 b, float weight) {
    if (weight <= 0.0 || !is_finite(a) || !is_finite(b)) return a;
    vec4 share = vec4(weight);
    float darkening = 1.0;
#if BLEND_TONEMAPPED
    const vec3 ea = clamp(a.rgb * block.exposure, -kLargestExposed, kLargestExposed);
    const vec3 eb = clamp(b.rgb * block.exposure, -kLargestExposed, kLargestExposed);
    const float ma = max(max(ea.r, ea.g), max(ea.b, 0.0));
    const float mb = max(max(eb.r, eb.g), max(eb.b, 0.0));
    const float wa = (1.0 - weight) * min(1.0, (1.0 + mb) / (1.0 + ma));
    const float wb = weight * min(1.0, (1.0 + ma) / (1.0 + mb));
    const vec3 below = wa * (ma - ea) + wb * (mb - eb);
    const float deficit = min(min(below.r, below.g), min(below.b, wa * ma + wb * mb));
    share.rgb = vec3(wb / (wa + wb));
    darkening = (wa + wb) / (wa + wb + deficit);
#endif
    vec4 mean = a + share * (b - a);
#if BLEND_TONEMAPPED
    // From the texel that weighs more: of a texel 1e9 times as bright as the other, 1 - share keeps
    // no digit.
    if (wb > wa) mean.rgb = b.rgb + wa / (wa + wb) * (a.rgb - b.rgb);
#endif
    // The clamp keeps rounding, and the overflow of b - a, inside the two texels' range.
    mean = clamp(mean, min(a, b), max(a, b));
    mean.rgb *= darkening;
    return mean;
}
