// Half-velocities: v = 0.5 shutter motion, |v| > r -> v r/|v| (radial, not per component), and how
// they are stored. STORAGE 0: not stored, and recomputed from the motion at each read; 1: fp16; 2:
// unorm8, the report's encoding with a code of its own for 0 (code = 128 + 127 v/r); 3: fp32.
// encode_velocity() rounds to the nearest value the texture can hold, so that tiles and gather read
// exactly the same vectors.

// A motion of 1e18 pixels or more (or NaN) counts as 0: its square would not fit a float.
const float kMaxSquare = 1e36;

float squared_length(vec2 v) {
    precise float squared = v.x * v.x + v.y * v.y;
    return squared;
}

// Before the clamp.
vec2 long_velocity(vec2 motion) {
    precise vec2 v = uniforms.half_shutter * motion;
    return squared_length(motion) <= kMaxSquare ? v : vec2(0.0);
}

// |v|, to the same bit wherever it is compared with a limit.
float length_of(vec2 v) {
    return sqrt(squared_length(v));
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
    return (roundEven(v * (127.0 / float(uniforms.tile_px))) + 128.0) / 255.0;
#else
    return v;
#endif
}

vec2 decode_velocity(vec2 stored) {
#if STORAGE == 2
    return (round(stored * 255.0) - 128.0) * (float(uniforms.tile_px) / 127.0);
#else
    return stored;
#endif
}
