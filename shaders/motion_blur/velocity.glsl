// Half-velocities: v = 0.5 shutter motion, |v| > r -> v r/|v| (radial, not per component), and how
// they are stored. STORAGE 0: not stored, and recomputed from the motion at each read; 1: fp16; 2:
// unorm8, the report's encoding with a code of its own for 0 (code = 128 + 127 v/r); 3: fp32.
// encode_velocity() rounds to the nearest value the texture can hold, so that tiles and gather read
// exactly the same vectors.

#include "common/finite.glsl"
#include "common/precise.glsl"

const float kMaxMotion = 1e15;  // px per frame, of a component: the square must fit a float

// A motion as the filter reads it: shortened along its direction, and 0 if it is not finite.
vec2 motion_of(vec2 texel) {
#ifdef SOFTWARE_RENDERER
    const float longest = max(abs(texel.x), abs(texel.y));
    const vec2 motion = longest > kMaxMotion ? texel * (kMaxMotion / longest) : texel;
#else
    // Nearly all: the lanes of a GPU skip the rest together.
    const uvec2 size = floatBitsToUint(texel) & 0x7fffffffu;
    if (max(size.x, size.y) <= floatBitsToUint(kMaxMotion)) return texel;
    // A GPU multiplies by the reciprocal, and that of 3e38 is subnormal: 0.
    const vec2 scaled = texel * 5.421010862427522e-20;  // 2^-64
    const vec2 motion = scaled * (kMaxMotion / max(abs(scaled.x), abs(scaled.y)));
#endif
    return is_finite(texel.x) && is_finite(texel.y) ? motion : vec2(0.0);
}

// Before the clamp.
vec2 long_velocity(vec2 texel) {
    precise vec2 v = uniforms.half_shutter * motion_of(texel);
    return v;
}

// `squared`: |v|^2 before the clamp.
vec2 clamped_velocity(vec2 v, float squared) {
    const float radius = float(uniforms.tile_px);
    precise vec2 clamped = v * (radius / sqrt(squared));
    return squared > radius * radius ? clamped : v;
}

vec2 encode_velocity(vec2 v) {
#if STORAGE == 1
    // Quantum of 11 significant bits: 2^-10 of the power of two below |v|,
    // at least the subnormal step 2^-24.
    const vec2 power = uintBitsToFloat(floatBitsToUint(v) & 0x7f800000u);
    const vec2 quantum = max(power * 9.765625e-4, 5.9604644775390625e-8);
    return roundEven(v / quantum) * quantum;
#elif STORAGE == 2
    precise const vec2 stored = (roundEven(v * (127.0 / float(uniforms.tile_px))) + 128.0) / 255.0;
    return stored;
#else
    return v;
#endif
}

vec2 decode_velocity(vec2 stored) {
#if STORAGE == 2
    precise const vec2 v = (round(stored * 255.0) - 128.0) * (float(uniforms.tile_px) / 127.0);
    return v;
#else
    return stored;
#endif
}

// Is a speed so low that nothing is blurred? By its square, whose root may differ from program to program of
// a GPU.
bool is_still(float squared) {
    precise const float limit = uniforms.still_limit_px * uniforms.still_limit_px;
    return squared <= limit;
}
