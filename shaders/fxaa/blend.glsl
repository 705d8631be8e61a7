// Mixing of texels. Needs uniforms.exposure; BLEND_TONEMAPPED.
//
// BLEND_TONEMAPPED: a pixel counts 1/sqrt(1 + m) times, m = max(0, r, g, b) of the exposed color, and
// a texel that is mixed into it as often, or less often if it is brighter: half-way between the mean
// of the stored values and the mean of the tone-mapped ones. So a bright pixel does not spread, and
// keeps its light. Color and alpha get the same weights, so that they still belong together: over any
// background, the result is the same mean of the composited texels.

#include "common/finite.glsl"

const float kMaxExposed = 1e30;
const float kNotLight = 1e-30;  // weight of a negative infinity

// Weight of a texel in the mean of the pixel `center`.
float brightness_weight(vec4 texel, vec4 center) {
    if (min(texel.r, min(texel.g, texel.b)) <= -kMaxHalf) return kNotLight;
#if BLEND_TONEMAPPED
    const vec3 larger = max(texel.rgb, center.rgb);
    const float largest = max(max(larger.r, larger.g), max(larger.b, 0.0)) * uniforms.exposure;
    precise const float exposed = 1.0 + min(largest, kMaxExposed);
    return inversesqrt(exposed);
#else
    return 1.0;
#endif
}

#ifdef LAYERS
// The effect of FXAA at a pixel: the weight of each of its neighbors' colors, in rows of three from
// the upper left; the rest is the pixel's own. Color decides it, also for the layers.
float shares[9];

int place_of(ivec2 offset) {
    return 3 * (offset.y + 1) + offset.x + 1;
}

// The part of b in the blend below.
float share_of(vec4 a, vec4 b, float weight) {
    if (weight <= 0.0) return 0.0;
    precise const float wa = (1.0 - weight) * brightness_weight(a, a);
    const float wb = weight * brightness_weight(b, a);
    precise const float share = wb / (wa + wb);
    return share;
}
#endif

// From the pixel's a (weight 0) to b (weight 1). Weight 0 or equal texels give a, bit for bit.
vec4 blend(vec4 a, vec4 b, float weight) {
    if (weight <= 0.0) return a;
    precise const float wa = (1.0 - weight) * brightness_weight(a, a);
    const float wb = weight * brightness_weight(b, a);
    // From the texel that weighs more: of a texel 1e9 times as bright as the other, 1 - share keeps
    // no digit. Each in a step of its own: as the two sides of a choice, a GPU's compiler rounded them in
    // one way in one program and in another way in the next.
    precise const float total = wa + wb;
    precise const float share_a = wa / total, share_b = wb / total;
    precise const vec4 difference = b - a;
    precise const vec4 from_a = a + share_b * difference, from_b = b - share_a * difference;
    const vec4 mean = wa >= wb ? from_a : from_b;
    // The clamp keeps rounding inside the two texels' range.
    return clamp(mean, min(a, b), max(a, b));
}
