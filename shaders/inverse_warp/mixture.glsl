// A pixel at a depth edge mixes the colors of two surfaces. It takes the color of its own surface from a
// pixel that shows it alone, or the surface in front (mixed_pixels.comp, split_pixels.comp).

// Difference between the paths of two surfaces, px^2.
float apart_by_motion(Surface s, Surface t) {
    const vec2 da = s.a - t.a, db = s.b - t.b;
    precise const float squared = precise_dot(da, da) + precise_dot(db, db);
    return squared;
}

// Do the displacements of two surfaces differ by more than px of motion, or kLensPartPx of radius?
bool part(Surface s, Surface t, float px) {
    bool by_motion = false, by_lens = false;
    if (kShutter) by_motion = apart_by_motion(s, t) > px * px;
    if (kLens) {
        precise const float radii = s.radius - t.radius;
        by_lens = abs(radii) > kLensPartPx;
    }
    return by_motion || by_lens;
}

// Does a surface leave its place so far?
bool leaves(Surface s, float px) {
    return (kShutter && path_of(s) > px) || (kLens && abs(s.radius) > kLensPartPx);
}

// A place is the number of a pixel in the square of 5 x 5 around, row by row.
const int kMixReachPx = 2;
const int kMixEdgePx = 2 * kMixReachPx + 1;
const uint kOwnPlace = 12u;
const float kParts = 63.0;  // in which a part of a pixel is counted

uint place_of(ivec2 offset) {
    return uint((offset.y + kMixReachPx) * kMixEdgePx + offset.x + kMixReachPx);
}

ivec2 offset_of(uint place) {
    const int at = int(place), y = (at * 13) >> 6;  // at / 5, which a software renderer does lane by lane
    return ivec2(at - kMixEdgePx * y, y) - kMixReachPx;
}

// The place around pixel x. A stored place may be any of 32.
vec2 beside(vec2 x, uint place) {
    precise const vec2 at = x + vec2(offset_of(place));
    return clamp(at, vec2(0.0), vec2(uniforms.size - 1));
}

// In a surface of this frame, whose `refuted` means that the place of its color is known: five more of the
// last bits of a.x are that place. Those of a.y are the place of a surface that stays in front of it, whose part
// of the pixel is in three more bits of both; kOwnPlace: none. Without motion the place is the pixel's own:
// inverse depth has no bits to spare.
#if MOTION
bool has_place(uvec4 bits) {
    return (bits.w & kRefuted) != 0u;
}

// With places in them the bits of a path of 0 would be a denormal number, of which each product takes a CPU a
// hundred times as long. So it becomes 2^-50 px.
uvec2 with_exponent(uvec2 path) {
    return path | mix(uvec2(0u), uvec2(0x26800000u), equal(path & 0x7f800000u, uvec2(0u)));
}

uvec4 with_place(uvec4 bits, uint place) {
    return uvec4(with_exponent(bits.xy) & ~0xf8u | uvec2(place, kOwnPlace) << 3, bits.z,
                 bits.w | kRefuted | kEdge);
}

uvec4 with_front(uvec4 bits, uint place, uint front, uint parts) {
    const uvec2 places = uvec2(place, front), halves = uvec2(parts >> 3, parts & 7u);
    return uvec4(with_exponent(bits.xy) & ~0x7f8u | halves << 8 | places << 3, bits.z,
                 bits.w | kRefuted | kEdge);
}

uint front_in(uvec4 bits) {
    return has_place(bits) ? bits.y >> 3 & 31u : kOwnPlace;
}

float front_part(uvec4 bits) {
    const uint parts = (bits.x >> 8 & 7u) << 3 | bits.y >> 8 & 7u;
    precise const float part = float(parts) * (1.0 / kParts);
    return front_in(bits) != kOwnPlace ? part : 0.0;
}

uint place_in(uvec4 bits) {
    return has_place(bits) ? bits.x >> 3 & 31u : kOwnPlace;
}
#else
bool has_place(uvec4 bits) {
    return (bits.x & kRefuted) != 0u;
}

uvec4 with_front(uvec4 bits, uint place, uint front, uint parts) {
    return bits;
}

uint front_in(uvec4 bits) {
    return kOwnPlace;
}

float front_part(uvec4 bits) {
    return 0.0;
}

uvec4 with_place(uvec4 bits, uint place) {
    return uvec4(bits.x | kRefuted | kEdge, bits.yzw);
}

uint place_in(uvec4 bits) {
    return kOwnPlace;
}
#endif
