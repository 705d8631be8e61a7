// The search for occluded surfaces in the frames before and after.
//
// BEFORE, AFTER: that frame is searched
#include "inverse_warp/frames.glsl"

#if BEFORE
layout(binding = 7) uniform sampler2D color_before;
layout(binding = 8) uniform usampler2D surfaces_before;
#endif
#if AFTER
layout(binding = 9) uniform sampler2D color_after;
layout(binding = 10) uniform usampler2D surfaces_after;
#endif
#if BEFORE && defined(LAYERS)
layout(binding = 15) uniform sampler2DArray layers_before;
#endif
#if AFTER && defined(LAYERS)
layout(binding = 5) uniform sampler2DArray layers_after;
#endif

const int kNeighborSteps = 3;  // from each start surface

Surface surface_in(int frame, ivec2 x) {
#if BEFORE
    if (frame < 0) return unpack_surface(texelFetch(surfaces_before, x, 0));
#endif
#if AFTER
    if (frame > 0) return unpack_surface(texelFetch(surfaces_after, x, 0));
#endif
    return unpack_surface(texelFetch(surfaces, x, 0));
}

vec4 color_in(int frame, vec2 at, Plane plane) {
#if BEFORE
    if (frame < 0) return color_at(WIDE(color_before, layers_before), plane, at);
#endif
#if AFTER
    if (frame > 0) return color_at(WIDE(color_after, layers_after), plane, at);
#endif
    return color_at(WIDE(color, layers), plane, at);
}

// Displacement of a neighbor's surface. Surfaces move from frame to frame, even if the shutter is
// closed.
vec2 displacement_from_neighbor(Surface s, Sample at) {
    if (!kLens) return moved(s, at);
    precise const vec2 d = moved(s, at) + s.radius * at.lens;
    return d;
}

// May this frame hide surface s, seen at pixel x of a neighbor? Not if it shows a farther one
// there.
bool may_be_occluded(Surface s, vec2 x, int frame, float ratio) {
    const vec2 at = place_here(s, x, frame);
    const ivec2 pixel = ivec2(inside_of(at));
    return at != vec2(pixel) || surface_in(0, pixel).inverse_depth * ratio >= s.inverse_depth;
}

// Searches one neighbor, from surface `begin`, for one nearer than `nearest` and no farther than
// the inverse depth `farthest`. Edge pixels, which mix two surfaces, count only if nothing else is
// found. A pixel that no search may find ends it.
void search_neighbor(int frame, Surface begin, vec2 p, Sample now, float farthest,
                     inout Found nearest) {
    const Sample then = seen_from(frame, now);
    const float ratio = now.depth_ratio;
    begin.b = vec2(0.0);  // a parabola about this frame is not one about the neighbor
    vec2 d = displacement_from_neighbor(begin, then);
    for (int i = 0; i < kNeighborSteps; ++i) {
        precise const vec2 to = p + floor(0.5 - d);
        const vec2 x = inside_of(to);
        const Surface s = surface_in(frame, ivec2(x));
        if (s.inverse_depth < 0.0) break;
        d = displacement_from_neighbor(s, then);
        precise const vec2 off = abs(x - p + d), at = p - d;
        if (max(off.x, off.y) > kAcceptPx || (s.edge && nearest.inverse_depth >= 0.0) ||
            s.inverse_depth <= nearest.inverse_depth * ratio ||
            s.inverse_depth * ratio < farthest || !may_be_occluded(s, x, frame, ratio))
            continue;
        nearest = Found(frame, s.edge ? x : inside_of(at), s.inverse_depth, s.a, false);
    }
}

// Is this surface, which the sample sees, beyond the border of a neighbor? What that shows may be
// behind it.
bool is_beyond(int frame, Surface s, vec2 p, Sample now) {
    s.b = vec2(0.0);
    precise const vec2 at = floor(p - displacement_from_neighbor(s, seen_from(frame, now)) + 0.5);
    return at != inside_of(at);
}

// The nearest surface that the sample sees in any frame, `nearest` so far: from the farthest surface visited, if this
// frame shows nothing (bit 0), and from each start surface that this frame may hide (bits 1 ..).
// The neighbor nearer in time goes first. If the farthest surface visited is behind the first, no
// farther one counts: it would be behind both. Nor does one from a neighbor for whose border the
// farthest is too far out.
Found resolve_occluded(Pixel pixel, Sample now, Search here, Found nearest) {
    const float farthest = here.shows_behind ? here.far.inverse_depth : 0.0;
    uint begins = (here.occluded_starts << 1) | (here.nearest.inverse_depth < 0.0 ? 1u : 0u);
    bool second = false;  // of two neighbors
    while (begins != 0u) {
        const int start = findLSB(begins) - 1;
        const int frame = kBefore && (!kAfter || (now.u >= 0.0) == second) ? -1 : 1;
        second = kBefore && kAfter && !second;
        if (!second) begins &= begins - 1u;
        Surface begin = here.far;
        for (int i = 0; i < STARTS; ++i)
            if (i == start) begin = pixel.starts[i];
        if (begin.inverse_depth <= nearest.inverse_depth * now.depth_ratio) continue;
        const bool beyond = here.nearest.inverse_depth < 0.0 &&
                            is_beyond(frame, here.far, pixel.p, now);
        search_neighbor(frame, begin, pixel.p, now, beyond ? here.far.inverse_depth : farthest,
                        nearest);
    }
    return nearest;
}
