// The search for occluded surfaces in the frames before and after.
//
// BEFORE, AFTER: that frame is searched
#include "common/software_loop.glsl"

#include "inverse_warp/frames.glsl"

#if BEFORE
layout(binding = GATHER_COLOR_BEFORE) uniform sampler2D color_before;
#endif
#if AFTER
layout(binding = GATHER_COLOR_AFTER) uniform sampler2D color_after;
#endif
#if BEFORE || AFTER
layout(binding = GATHER_NEIGHBOR_SURFACES) uniform usampler2D neighbor_surfaces;
#endif
#if BEFORE && defined(LAYERS)
layout(binding = GATHER_LAYERS_BEFORE) uniform sampler2DArray layers_before;
#endif
#if AFTER && defined(LAYERS)
layout(binding = GATHER_LAYERS_AFTER) uniform sampler2DArray layers_after;
#endif

uvec4 surface_in(int frame, ivec2 x) {
#if BEFORE || AFTER
    const ivec2 at = kBefore && frame > 0 ? x + second_half() : x;
    return texelFetch(neighbor_surfaces, at, 0);
#else
    return pack_surface(not_there());
#endif
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

// A search begins with the straight part of the displacement: a parabola about this frame is not one
// about the neighbor.
vec2 straight_from_neighbor(Surface s, Sample at) {
    precise vec2 d = s.a * at.u;
    if (kLens) d += s.radius * at.lens;
    return d;
}

// Is this surface, which the sample sees at this time of a neighbor, beyond the neighbor's border? Surfaces
// shown there may be behind it.
bool is_beyond(Surface s, vec2 p, Sample then) {
    precise const vec2 at = floor(p - straight_from_neighbor(s, then) + 0.5);
    return at != inside_of(at);
}

// Does the farthest surface visited, which was not accepted, come almost to p? If it turns or
// stretches, the steps end beside the pixel that comes there.
bool comes_close(Search here, vec2 p, Sample now) {
    precise const vec2 to = p - displacement(here.far, now), off = abs(here.far_at - to);
    return to == inside_of(to) && max(off.x, off.y) <= kClosePx;
}

// The pixel from which a surface displaced by d comes to p.
vec2 pixel_before(vec2 p, vec2 d) {
    precise const vec2 x = p + floor(0.5 - d);
    return inside_of(x);
}

// A surface must have more than this inverse depth to replace the one found. The same surface replaces one in
// another light.
float limit_beside(Found found, bool other_light, float ratio) {
    precise const float limit =
        found.inverse_depth * (found.other_light && !other_light ? 1.0 / kOneDepth : ratio);
    return limit;
}

// The nearest surface that the sample sees in any frame, `nearest` so far. Searches in their order,
// a bit each: from the farthest surface visited in the neighbor nearer in time and in the other one
// (bits 0 and 1), if this frame shows nothing; from each start surface that this frame may hide in
// the neighbor nearer in time (bits 2 ..). If the farthest surface visited is behind the first, comes
// almost to the pixel, or comes from beyond the border, nothing behind it counts. Edge pixels, which
// mix two surfaces, count only if nothing else is found. A search ends at a pixel that no search may
// find or that is not nearer than what was found.
//
// All searches are one loop, a visit each time: lanes do not wait for each other's searches.
Found resolve_occluded(Pixel pixel, Sample now, Search here, Found nearest) {
    const float ratio = now.depth_ratio;
    const int nearer = kBefore && (!kAfter || now.u < 0.0) ? -1 : 1;
    const bool shown = here.nearest.inverse_depth >= 0.0;
    const bool covered = here.shows_behind || (!shown && comes_close(here, pixel.p, now));
    const uint from_far = shown ? 0u : (kBefore && kAfter ? 3u : 1u);
    const Sample at_nearer = seen_from(nearer, now), at_other = seen_from(-nearer, now);
    const bool limited = covered || (!shown && is_beyond(here.far, pixel.p, at_nearer));
    const bool limited_other = covered || (!shown && is_beyond(here.far, pixel.p, at_other));
    uint searches = (here.starts & kHidden - 1u) << 2 | from_far;
    int steps = 0;
    bool other = false;
    Sample then = now;
    vec2 x = pixel.p;
    if (searches != 0u) SOFTWARE_LOOP do {
        if (steps == 0) {
            const int search = findLSB(searches);
            searches &= searches - 1u;
            other = search == 1;
            then.u = other ? at_other.u : at_nearer.u;
            then.bend = other ? at_other.bend : at_nearer.bend;
            Surface begin = start_surface(search - 2);
            if (search < 2) begin = here.far;
            if (begin.inverse_depth <= limit_beside(nearest, false, ratio)) {
                // Start surfaces are nearest first.
                if (search >= 2) searches = 0u;
                continue;
            }
            x = pixel_before(pixel.p, straight_from_neighbor(begin, then));
        }
        const int frame = other ? -nearer : nearer;
        const float farthest = (other ? limited_other : limited) ? here.far.inverse_depth : 0.0;
        const uvec4 bits = surface_in(frame, ivec2(x));
        const Surface s = unpack_neighbor(bits);
        const vec2 d = displacement_from_neighbor(s, then);
        const vec2 next = pixel_before(pixel.p, d);
        precise const vec2 off = abs(x - pixel.p + d), at = pixel.p - d;
        const bool ends = s.inverse_depth < 0.0 ||
                          s.inverse_depth <= limit_beside(nearest, is_in_other_light(bits), ratio);
        if (!ends && max(off.x, off.y) <= kAcceptPx && !(s.edge && nearest.inverse_depth >= 0.0) &&
            s.inverse_depth * ratio >= farthest && !s.refuted)
            nearest = Found(frame, s.edge ? x : inside_of(at), s.inverse_depth, s.a, false, s.edge,
                            is_in_other_light(bits));
        steps = ends || next == x || steps == kNeighborSteps - 1 ? 0 : steps + 1;
        x = next;
    } while (searches != 0u || steps > 0);
    return nearest;
}

// Would the fill at the place `at`, behind the farthest surface visited, show the surface found or one hardly
// farther?
bool is_filled(Found found, Surface far, vec2 at) {
    const Cells cells = background_cells(at, far.inverse_depth);
    const vec4 depths = vec4(depth_of_cell(cells.upper.xy), depth_of_cell(cells.upper.zw),
                             depth_of_cell(cells.lower.xy), depth_of_cell(cells.lower.zw));
    precise float near = 0.0;
    for (int i = 0; i < 4; ++i)
        if (depths[i] * kBehind > found.inverse_depth) near += cells.weights[i];
    return near > 0.0 && near >= kFilled * cells.total;
}

// Was the farthest surface visited found at a neighbor's edge, and does this frame show it beside the place
// `at` that the sample sees? If it and what hides it stay in place, that pixel, which mixes both, shows no more.
bool shows_beside(Found found, Surface far, vec2 at) {
    if (!found.edge || !one_depth(found.inverse_depth, far.inverse_depth)) return false;
    precise const vec2 rounded = floor(at + 0.5);
    const Surface front = unpack_surface(texelFetch(surfaces, ivec2(rounded), 0));
    return max(path_of(far), path_of(front)) <= kStillPx &&
           cells_around(smallest_cells(at), far.inverse_depth).total > 0.0;
}
