#version 450 core
// Copies color with one fault (tests/stress/faulty_pass.h); RUN counts the plans made.
layout(local_size_x = 16, local_size_y = 16) in;
layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D inverse_depth;
layout(binding = 0) writeonly uniform image2D result;

const int kTile = 40;

vec4 at(ivec2 p) {
    return texelFetch(color, clamp(p, ivec2(0), textureSize(color, 0) - 1), 0);
}

void main() {
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    const ivec2 size = imageSize(result);
    if (any(greaterThanEqual(p, size))) return;
    vec4 c = at(p);
#if FAULT == 1  // looks_left
    c = 0.75 * c + 0.25 * at(p - ivec2(1, 0));
#elif FAULT == 2  // looks_up
    c = 0.75 * c + 0.25 * at(p - ivec2(0, 1));
#elif FAULT == 3  // blurs_rows
    c = 0.5 * c + 0.25 * (at(p - ivec2(1, 0)) + at(p + ivec2(1, 0)));
#elif FAULT == 4  // shades_tiles
    c *= 1.0 + (p.x % kTile) / float(kTile) + 2.0 * (p.y % kTile) / float(kTile);
#elif FAULT == 5  // shades_frame
    c *= 1.0 + 4.0 * p.x / size.x + 8.0 * p.y / size.y;
#elif FAULT == 6  // brightens
    c *= 1.1;
#elif FAULT == 7  // dims
    c *= 0.9;
#elif FAULT == 8  // counts_runs
    c += 1e-3 * RUN;
#elif FAULT == 9  // takes_depth
    c *= texelFetch(inverse_depth, p, 0).r;
#endif
    imageStore(result, p, c);
}
