// Surfaces that this frame hides, and that continue behind what it shows (continuation.comp).
#include "common/software_loop.glsl"

struct Continuation {
    float inverse_depth;  // -1: none
    uvec2 sides;          // cells that show it on both sides
    vec2 path;            // a
    vec2 at;              // where it is in this frame, px
};

// The cells on both sides of what pixel x shows, of inverse depth q: its own, if that shows what is
// behind too.
uvec2 sides_of(vec2 x, float q) {
    const ivec2 cell = ivec2(x) / 2;
    const vec2 texel = texelFetch(background, cell, 0).xy;
    return texel.x * kOneDepth < q ? uvec2(pack_cell(cell)) : sides_of(texel.y, cell);
}

// The nearest start surface, nearer than the inverse depth `found`, that is displaced to the pixel
// from behind what this frame shows.
Continuation find_continuation(Pixel pixel, Sample now, Search here, float found) {
    Continuation continued = Continuation(-1.0, uvec2(kNoCell), vec2(0.0), pixel.p);
    uint starts_left = here.starts / kHidden;
    if (starts_left != 0u) SOFTWARE_LOOP do {
        const int i = findLSB(starts_left);
        starts_left &= starts_left - 1u;
        const Surface start = start_surface(i);
        if (start.inverse_depth <= kOneDepth * found) break;
        const vec2 d = displacement(start, now);
        precise const vec2 x = pixel.p + floor(0.5 - d), to = pixel.p - d;
        const float occluder = unpack_surface(texelFetch(surfaces, ivec2(x), 0)).inverse_depth;
        const uvec2 sides = sides_of(x, occluder);
        if (sides.x == kNoCell) continue;
        const float shown = texelFetch(background, unpack_cell(sides.x), 0).x;
        if (!one_depth(shown, start.inverse_depth)) continue;
        const vec2 at = inside_of(to);
        continued = Continuation(start.inverse_depth, sides, start.a, at);
        break;
    } while (starts_left != 0u);
    return continued;
}

// The cells on both sides of what hides a surface, by their distance to the position `x`.
Cells continuation_cells(uvec2 sides, vec2 x) {
    const ivec2 a = unpack_cell(sides.x), b = unpack_cell(sides.y);
    const vec2 way = vec2(b - a);
    precise const float share =
        clamp(precise_dot(0.5 * x - vec2(a), way) / max(precise_dot(way, way), 1.0), 0.0, 1.0);
    // The first color's difference to itself is 0, whatever its weight.
    return Cells(ivec4(a, b), ivec4(a, a), vec4(1.0, share, 0.0, 0.0), 1.0);
}
