// The start surfaces of a work group's block, nearest first. A GPU keeps them in the group's memory: in
// registers they would take so many that fewer groups run at a time. Shared memory and barriers cost a
// software renderer more than they save, so there each pixel keeps its own.

// The texel of start surface i; behind the last one the block's summary, which no search uses.
uvec4 start_texel(ivec2 block, int i) {
    const ivec2 first = ivec2((uniforms.starts + 1) * block.x, block.y);
    return texelFetch(starts, first + ivec2(min(i, uniforms.starts), 0), 0);
}

#ifdef SOFTWARE_RENDERER
Surface block_starts[STARTS];

void load_starts(ivec2 block) {
    for (int i = 0; i < STARTS; ++i) block_starts[i] = unpack_surface(start_texel(block, i));
}

Surface start_surface(int number) {
    Surface start = block_starts[0];
    for (int i = 1; i < STARTS; ++i)
        if (i == number) start = block_starts[i];
    return start;
}
#else
// Unpacked once: a search reads one of them after almost every step.
shared vec4 start_paths[STARTS];  // a, b
shared vec3 start_rest[STARTS];   // inverse depth, straight, radius

void load_starts(ivec2 block) {
    const int i = int(gl_LocalInvocationIndex);
    if (i < STARTS) {
        const Surface start = unpack_surface(start_texel(block, i));
        start_paths[i] = vec4(start.a, start.b);
        start_rest[i] = vec3(start.inverse_depth, start.straight, start.radius);
    }
    barrier();
}

// Without its flags, which no search reads.
Surface start_surface(int number) {
    const int i = clamp(number, 0, STARTS - 1);
    const vec4 paths = start_paths[i];
    const vec3 rest = start_rest[i];
    return Surface(rest.x, false, false, paths.xy, paths.zw, rest.y, rest.z);
}
#endif
