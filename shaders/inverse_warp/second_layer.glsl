// The search for occluded surfaces in the layer behind (chain/frame/behind.h), which shows the first
// surface that each pixel hides, at the frame's own time. Its surfaces are in `surfaces`, below the
// frame's.
//
// SECOND_LAYER: defined if the frame has that layer

const int kSecondLayer = 4;  // of Found::frame and Source::kind

#ifdef SECOND_LAYER
layout(binding = GATHER_SECOND_LAYER) uniform sampler2DArray second_layer;

const int kFirstPlaneOfLayers = 3;  // color, inverse depth and motion come before

// Below 0: nothing is known behind the pixel.
Surface second_surface(ivec2 x) {
    return unpack_surface(texelFetch(surfaces, x + second_half(), 0));
}

// Searches from surface `begin`, for a surface nearer than `nearest` and no farther than the
// inverse depth `farthest`. A pixel of the layer that is nearer than what the frame shows there
// does not count.
void search_second_layer(Surface begin, vec2 p, Sample now, float farthest, inout Found nearest) {
    const float ratio = now.depth_ratio;
    if (begin.inverse_depth <= nearest.inverse_depth * ratio) return;
    vec2 d = displacement(begin, now);
    for (int i = 0; i < kSecondSteps; ++i) {
        precise const vec2 to = p + floor(0.5 - d);
        const vec2 x = inside_of(to);
        const Surface s = second_surface(ivec2(x));
        if (s.inverse_depth < 0.0) break;
        d = displacement(s, now);
        precise const vec2 off = abs(x - p + d), at = p - d;
        const float shown = unpack_surface(texelFetch(surfaces, ivec2(x), 0)).inverse_depth;
        if (max(off.x, off.y) > kAcceptPx ||
            s.inverse_depth <= nearest.inverse_depth * ratio ||
            s.inverse_depth * ratio < farthest || shown * ratio < s.inverse_depth)
            continue;
        nearest = Found(kSecondLayer, s.edge ? x : inside_of(at), s.inverse_depth, s.a, false, false,
                        false);
    }
}

// The nearest surface that the sample sees in this frame or in the layer: from what the pixel
// itself hides, from the farthest surface visited if this frame shows nothing, and from each start
// surface that this frame may hide. If the farthest surface visited is behind the first, or comes
// from beyond the border, nothing behind it counts.
Found resolve_second_layer(Pixel pixel, Sample now, Search here) {
    Found nearest = here.nearest;
    float farthest = here.shows_behind ? here.far.inverse_depth : 0.0;
    if (nearest.inverse_depth < 0.0) {
        precise const vec2 at = floor(pixel.p - displacement(here.far, now) + 0.5);
        if (at != inside_of(at)) farthest = here.far.inverse_depth;
    }
    const Surface own = second_surface(pixel.at);
    if (own.inverse_depth >= 0.0) search_second_layer(own, pixel.p, now, farthest, nearest);
    if (nearest.inverse_depth < 0.0)
        search_second_layer(here.far, pixel.p, now, farthest, nearest);
    for (int i = 0; i < STARTS; ++i)
        if ((here.starts >> i & 1u) != 0u)
            search_second_layer(start_surface(i), pixel.p, now, farthest, nearest);
    return nearest;
}

vec4 second_texel(Plane plane, ivec2 at) {
    if (!plane.is_color)
        return texelFetch(second_layer, ivec3(at, kFirstPlaneOfLayers + plane.layer), 0);
    return finite_color(texelFetch(second_layer, ivec3(at, 0), 0));
}

vec4 second_color(vec2 at, Plane plane) {
    const Corners corners = corners_of(at);
    const ivec2 a = corners.nearest, b = corners.across;
    return bilinear(second_texel(plane, a), second_texel(plane, ivec2(b.x, a.y)),
                    second_texel(plane, ivec2(a.x, b.y)), second_texel(plane, b), corners.f);
}
#else
Found resolve_second_layer(Pixel pixel, Sample now, Search here) {
    return here.nearest;
}

vec4 second_color(vec2 at, Plane plane) {
    return vec4(0.0);
}
#endif
