// Half-velocities: their length, and how they are stored. STORAGE 0: fp32; 1: fp16; 2: unorm8, the
// report's encoding with a code of its own for 0 (code = 128 + 127 v/r). encode_velocity() rounds
// to the nearest value the texture can hold, so that the tiles see exactly the vectors that the
// gather will see.

// |v|, to the same bit wherever it is compared with a limit.
float length_of(vec2 v) {
    precise float squared = v.x * v.x + v.y * v.y;
    return sqrt(squared);
}

vec2 encode_velocity(vec2 v) {
#if STORAGE == 1
    // Quantum of 11 significant bits: 2^-10 of the power of two below |v|,
    // at least the subnormal step 2^-24.
    const vec2 power = uintBitsToFloat(floatBitsToUint(v) & 0x7f800000u);
    const vec2 quantum = max(power * 9.765625e-4, 5.9604644775390625e-8);
    return roundEven(v / quantum) * quantum;
#elif STORAGE == 2
    return (roundEven(v * (127.0 / float(block.tile_px))) + 128.0) / 255.0;
#else
    return v;
#endif
}

vec2 decode_velocity(vec2 stored) {
#if STORAGE == 2
    return (round(stored * 255.0) - 128.0) * (float(block.tile_px) / 127.0);
#else
    return stored;
#endif
}
