// The search of one sample in this frame, by fixed-point iteration: X <- p - D(X).
#include "common/software_loop.glsl"

const bool kBefore = BEFORE == 1, kAfter = AFTER == 1, kNeighbors = kBefore || kAfter;
#ifdef SECOND_LAYER
const bool kHasSecondLayer = true;
#else
const bool kHasSecondLayer = false;
#endif
const bool kSearchedOutside = kNeighbors || kHasSecondLayer;  // for what this frame hides
const int kOwnSteps = kLens && !kShutter ? 1 : kSteps;  // from the pixel itself
// px: the displacements of surfaces that move together differ by at most this.
const float kTogether = kLens ? kTogetherLensPx : kTogetherPx;

// A place in a frame that shows the sample's surface. Its inverse depth is -1 if there is none.
struct Found {
    int frame;  // -1: before, 0: this one, 1: after, kSecondLayer
    vec2 at;    // px
    float inverse_depth;
    vec2 path;    // a
    bool beyond;  // this frame's border pixels, continued beyond it
    bool edge;    // of a neighbor: its pixel is at a depth edge
    bool other_light;  // of a neighbor: in_other_light()
};

// One step: the pixel X that it visits, and whether the surface there is the sample's.
struct Visit {
    vec2 x;
    bool beyond;  // X lies beyond the frame, whose border pixels go on
    uvec4 bits;   // the surface there, packed
    Surface surface;
    vec2 d;       // D(X)
    float error;  // |X + D(X) - p|, the longer axis
    bool accepted;
};

// Result of the search.
struct Search {
    Found nearest;         // of the accepted surfaces
    vec2 nearest_at;       // its pixel
    bool nearest_edge;     // which is at a depth edge: its color is read at_edge()
    uint nearest_place;    // of its color, around the pixel (mixture.glsl)
    Surface far;           // the farthest surface visited
    vec2 far_at;           // its pixel
    bool shows_behind;     // the farthest surface is behind the first
    uint starts;           // a bit for each start surface that this frame may hide; kHidden times it if the
                           // surface is behind what this frame shows at its place
    float deferred_for;    // inverse depth of the nearest that a sample is deferred for; -1: none
};

const uint kHidden = 256u;

// State of its loop. A software renderer writes all of it at each visit, so it is small.
struct SearchState {
    vec2 d;               // displacement of the surface from which the next step goes
    int start;            // 0: from the pixel itself; i + 1: from start surface i
    float start_depth;    // inverse depth of that start surface
    int steps;            // so far, from that
    float occluded_from;  // start surfaces with at most this inverse depth are not searched
    float residual;       // of Search::nearest
    float far_residual;   // of Search::far
    float first_depth;    // inverse depth of the first surface visited; below 0 before that
    uvec4 nearest;        // Search::nearest, packed
    uint nearest_at;      // pixel_word() of its pixel
    uint far_at;          // and of Search::far
};

vec2 inside_of(vec2 at) {
    return clamp(at, vec2(0.0), vec2(uniforms.size - 1));
}

const uint kBeyondWord = 1u << 31;

uint pixel_word(vec2 x, bool beyond) {
    return pack_cell(ivec2(x)) | (beyond ? kBeyondWord : 0u);
}

vec2 pixel_in(uint word) {
    return vec2(unpack_cell(word & ~kBeyondWord));
}

SearchState begin_state(Surface begin, Pixel pixel, Sample now) {
    const uint at = pixel_word(pixel.p, false);
    return SearchState(displacement(begin, now), 0, 0.0, 0, -1.0, kAcceptPx, 3.4e38, -1.0, uvec4(0u), at, at);
}

// The result before the first visit.
Search begin_search(Pixel pixel, Surface begin) {
    Search s;
    s.nearest = Found(0, pixel.p, -1.0, vec2(0.0), false, false, false);
    s.nearest_at = pixel.p;
    s.nearest_edge = false;
    s.nearest_place = kOwnPlace;
    s.far = begin;
    s.far.inverse_depth = 3.4e38;
    s.far_at = pixel.p;
    s.shows_behind = false;
    s.starts = 0u;
    s.deferred_for = -1.0;
    return s;
}

// The step from p by the displacement d. A neighbor may have seen what lies beyond this frame, so
// nothing is accepted there if one is searched.
Visit visit(vec2 p, vec2 d, Sample now) {
    // As a distance from p: far from the frame's origin a position has fewer digits.
    precise const vec2 to_x = floor(0.5 - d), x = p + to_x;
    Visit v;
    v.x = inside_of(x);
    v.beyond = x != v.x;
    v.bits = texelFetch(surfaces, ivec2(v.x), 0);
    v.surface = unpack_surface(v.bits);
    v.d = displacement(v.surface, now);
    precise const vec2 off = abs(to_x + v.d);
    v.error = max(off.x, off.y);
    v.accepted = v.error <= kAcceptPx && !(kNeighbors && v.beyond);
    return v;
}

// Whether pixel x moves along with a surface at inverse depth q that has the path a and is displaced
// by d. A mixture of two surfaces moves along with the nearer one, so that a nearer pixel must have the
// same path.
bool moves_along(vec2 x, float q, vec2 a, vec2 d, Sample now) {
    const Surface s = unpack_surface(texelFetch(surfaces, ivec2(inside_of(x)), 0));
    precise const vec2 e = displacement(s, now) - d, f = kShutter ? s.a - a : vec2(0.0);
    return precise_dot(e, e) <= kTogether * kTogether &&
           (s.inverse_depth <= q * kOneDepth || precise_dot(f, f) <= kSamePathPx * kSamePathPx);
}

// The surface s that this frame shows at pixel x, displaced by d to p.
Found found_at(vec2 x, Surface s, vec2 d, bool beyond, vec2 p) {
    precise const vec2 at = p - d;
    return Found(0, inside_of(at), s.inverse_depth, s.a, beyond, false, false);
}

// The position at which the color of edge pixel x is read, whose surface at inverse depth q with the
// path a is at `at`. An edge pixel mixes two surfaces: it is interpolated only toward adjacent pixels
// that move along, which makes the same mixture.
vec2 at_edge(vec2 x, vec2 at, float q, vec2 a, vec2 p, Sample now) {
    precise const vec2 to = sign(at - x), d = p - at, across = x + vec2(to.x, 0.0),
                       down = x + vec2(0.0, to.y);
    return vec2(moves_along(across, q, a, d, now) ? at.x : x.x,
                moves_along(down, q, a, d, now) ? at.y : x.y);
}

// The nearest accepted surface counts; at one depth the one with the smaller error.
void keep_nearest(inout Search s, inout SearchState state, Visit v, float ratio) {
    const float q = v.surface.inverse_depth, nearest = s.nearest.inverse_depth;
    if (!v.accepted ||
        !(q > nearest * ratio || (q * ratio >= nearest && v.error < state.residual)))
        return;
    s.nearest.inverse_depth = q;
    state.nearest = v.bits;
    state.nearest_at = pixel_word(v.x, v.beyond);
    state.residual = v.error;
}

// The farthest surface visited is the one to extend if nothing is found; at one depth the one with
// the smaller error.
void keep_farthest(inout Search s, inout SearchState state, Visit v, float ratio) {
    const float q = v.surface.inverse_depth, far = s.far.inverse_depth;
    if (!(q * ratio < far || (q <= far * ratio && v.error < state.far_residual))) return;
    s.far.inverse_depth = q;
    state.far_residual = v.error;
    state.far_at = pixel_word(v.x, false);
}

// A start surface may be occluded if a step visits a nearer one or leaves the frame, or if the last
// step still visits one that is not farther: an earlier one may lead to the surface itself.
void note_occluded(inout Search s, inout SearchState state, Visit v, float ratio) {
    const float q = v.surface.inverse_depth;
    if (state.first_depth < 0.0) state.first_depth = q;
    if (state.start == 0 || v.accepted) return;
    const bool nearer = q > state.start_depth * ratio;
    const bool unsettled = state.steps == kSteps - 1 && q * ratio >= state.start_depth;
    if (!v.beyond && !nearer && !unsettled) return;
    const uint start = 1u << (state.start - 1);
    const bool hidden = state.steps == 0 && !v.beyond;
    s.starts |= start | (hidden ? kHidden * start : 0u);
    // Start surfaces are searched nearest first.
    if ((kSearchedOutside || hidden) && s.deferred_for < 0.0) s.deferred_for = state.start_depth;
}

// Does the search from a start surface end at this visit? A surface that is not nearer than the one
// found leads to no nearer one.
bool leads_nowhere(Search s, SearchState state, Visit v, float ratio) {
    return state.start > 0 && s.nearest.inverse_depth >= 0.0 &&
           v.surface.inverse_depth <= s.nearest.inverse_depth * ratio;
}

// Goes on to the next start surface, unless the surface found occludes all that are left: one found
// from the pixel itself occludes all that are not nearer; one found from a start surface only those
// that are farther, because the order of start surfaces must not count.
bool next_start(Search s, inout SearchState state, Pixel pixel, Sample now) {
    const float nearest = s.nearest.inverse_depth;
    state.occluded_from = state.start == 0 ? nearest * now.depth_ratio
                                           : max(state.occluded_from, nearest / now.depth_ratio);
    state.steps = 0;
    const bool more = state.start < pixel.start_count;
    const Surface start = start_surface(state.start);
    state.d = displacement(start, now);
    state.start_depth = start.inverse_depth;
    ++state.start;
    return more && state.start_depth > state.occluded_from;
}

// One visit, and where to go from there. False if the search has ended.
bool search_on(inout Search s, inout SearchState state, Pixel pixel, Sample now,
               inout uvec4 begin) {
    const Visit v = visit(pixel.p, state.d, now);
    keep_nearest(s, state, v, now.depth_ratio);
    keep_farthest(s, state, v, now.depth_ratio);
    note_occluded(s, state, v, now.depth_ratio);
    if (!kLens && v.accepted && state.start == 0) begin = v.bits;
    state.d = v.d;
    ++state.steps;
    bool more = true;
    if (v.accepted || leads_nowhere(s, state, v, now.depth_ratio) ||
        state.steps >= (state.start == 0 ? kOwnSteps : kSteps))
        more = next_start(s, state, pixel, now);
    return more;
}

// The nearest surface found. If there is none, its inverse depth alone counts.
void unpack_nearest(inout Search s, SearchState state, Pixel pixel, Sample now) {
    Surface surface = unpack_surface(state.nearest);
    surface.inverse_depth = s.nearest.inverse_depth;
    s.nearest_at = pixel_in(state.nearest_at);
    s.nearest = found_at(s.nearest_at, surface, displacement(surface, now),
                         (state.nearest_at & kBeyondWord) != 0u, pixel.p);
    s.nearest_edge = surface.edge;
    s.nearest_place = place_in(state.nearest);
}

// Searches from the surface `begin`, then from the start surfaces of the pixel's block, nearest
// first. With the shutter alone, `begin` becomes the surface found from it: the search of the next
// time sample begins there.
Search search(Pixel pixel, Sample now, inout uvec4 begin) {
    const Surface first = unpack_surface(begin);
    Search s = begin_search(pixel, first);
    SearchState state = begin_state(first, pixel, now);
    bool more = true;
#ifdef SOFTWARE_RENDERER
    SOFTWARE_LOOP do {
        more = search_on(s, state, pixel, now, begin);
    } while (more);
#else
    // Mesa's lavapipe 22.3 mixes up visits in this loop if it tests at its end.
    while (more) more = search_on(s, state, pixel, now, begin);
#endif
    s.shows_behind = s.far.inverse_depth * now.depth_ratio < state.first_depth;
    s.far_at = pixel_in(state.far_at);
    unpack_nearest(s, state, pixel, now);
    return s;
}
