// What the frames before and after show of surfaces that this frame hides.
#if BEFORE
layout(binding = 7) uniform sampler2D color_before;  // linear
layout(binding = 8) uniform usampler2D surfaces_before;
#endif
#if AFTER
layout(binding = 9) uniform sampler2D color_after;  // linear
layout(binding = 10) uniform usampler2D surfaces_after;
#endif
#ifdef LAYERS
#if BEFORE
layout(binding = 15) uniform sampler2DArray layers_before;  // linear
#endif
#if AFTER
layout(binding = 5) uniform sampler2DArray layers_after;  // linear
#endif
#endif

const int kNeighborSteps = 3;  // of the iteration from each start

// The displacement with the motion of a frame, whatever is blurred: a neighbor is a frame away.
vec2 displacement_from_neighbor(Surface s, Sample at) {
#if LENS
    return moved(s, at) + s.radius * at.lens;
#else
    return moved(s, at);
#endif
}

// The same instant, as seen from the frame after or before.
Sample seen_from(Sample at, bool after) {
    const float frame = 1.0 / uniforms.half_shutter;
    at.u += after ? -frame : frame;
    at.bend = bend_at(at.u);
    return at;
}

uvec4 surface_bits_of(bool after, ivec2 x) {
#if BEFORE && AFTER
    if (!after) return texelFetch(surfaces_before, x, 0);
#endif
#if AFTER
    return texelFetch(surfaces_after, x, 0);
#else
    return texelFetch(surfaces_before, x, 0);
#endif
}

vec4 color_of(bool after, vec2 at) {
#if BEFORE && AFTER
    if (!after) return color_at(color_before, at);
#endif
#if AFTER
    return color_at(color_after, at);
#else
    return color_at(color_before, at);
#endif
}

#ifdef LAYERS
void layers_of(bool after, vec2 at) {
#if AFTER
    if (after) layers_at(color_after, layers_after, at, seen_layers);
#endif
#if BEFORE
    if (!after) layers_at(color_before, layers_before, at, seen_layers);
#endif
}
#endif

// What a neighbor has seen: color, and of its surface inverse depth and path a.
struct Seen {
    vec4 color;
    float inverse_depth;
    vec2 path;
};

// Is there room in this frame for surface s, seen at pixel x of a neighbor? Not where this frame
// shows what is farther.
bool may_be_hidden(Surface s, vec2 x, bool after, float one_depth) {
    Sample here;
    here.u = 0.0;
    here = seen_from(here, after);
    const vec2 at = floor(x + moved(s, here) + 0.5);
    const ivec2 pixel = ivec2(inside_of(at));
    return at != vec2(pixel) ||
           unpack_surface(texelFetch(surfaces, pixel, 0)).inverse_depth * one_depth >=
               s.inverse_depth;
}

// Searches a sample in both frames, the nearer in time first: from the farthest surface met, if this
// frame shows nothing there (`nearest` is below 0), and from the starts that are hidden in it, a bit
// each. What is found is nearer than the inverse depth `nearest`; and, if `far` is behind the surface
// that the sample's first step has come to (`shows_behind`), no farther than it. Pixels at edges, which
// show two surfaces, count where nothing else is found. Fills seen_layers too.
bool seen_by_neighbors(vec2 p, Sample now, float one_depth, Surface far, bool shows_behind,
                       Surface start[STARTS], uint hidden_starts, float nearest, out Seen seen) {
    const float farthest = shows_behind ? far.inverse_depth : 0.0;
    bool found = false;
    uint begins = (hidden_starts << 1) | (nearest < 0.0 ? 1u : 0u);  // bit 0: far
    bool in_second = false;  // of the two frames
    while (begins != 0u) {
        const int index = findLSB(begins) - 1;
#if BEFORE && AFTER
        const bool after = (now.u >= 0.0) != in_second;
        in_second = !in_second;
#else
        const bool after = AFTER == 1;
#endif
        if (!in_second) begins &= begins - 1u;
        const Sample at = seen_from(now, after);
        Surface begin = far;
        for (int i = 0; i < STARTS; ++i)
            if (i == index) begin = start[i];
        if (begin.inverse_depth <= nearest * one_depth) continue;
        // Straight: a parabola about this frame is none about that one.
        begin.b = vec2(0.0);
        vec2 d = displacement_from_neighbor(begin, at);
        for (int i = 0; i < kNeighborSteps; ++i) {
            const vec2 x = inside_of(p + floor(0.5 - d));
            const Surface s = unpack_surface(surface_bits_of(after, ivec2(x)));
            d = displacement_from_neighbor(s, at);
            const vec2 off = abs(x - p + d);
            if (max(off.x, off.y) > kAcceptPx || (s.edge && nearest >= 0.0) ||
                s.inverse_depth <= nearest * one_depth ||
                s.inverse_depth * one_depth < farthest || !may_be_hidden(s, x, after, one_depth))
                continue;
            found = true;
            nearest = s.inverse_depth;
            const vec2 where = s.edge ? x : inside_of(p - d);
            seen = Seen(color_of(after, where), nearest, s.a);
#ifdef LAYERS
            layers_of(after, where);
#endif
        }
    }
    return found;
}
