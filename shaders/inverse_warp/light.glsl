// Finds a neighbor's surfaces in this frame, and compares their light in patches of kLightPatchPx.
#include "inverse_warp/frames.glsl"

const int kLightPatchPx = INVERSE_WARP_LIGHT_PATCH_PX;

// This frame at the place of a neighbor's surface.
struct Here {
    ivec2 at;
    bool inside;
    Surface surface;
};

// Surface s, seen at pixel x of the neighbor.
Here place_of(usampler2D surfaces_here, Surface s, ivec2 x) {
    const vec2 place = place_here(s, vec2(x), uniforms.neighbor);
    const vec2 at = clamp(place, vec2(0.0), vec2(uniforms.size - 1));
    return Here(ivec2(at), at == place, unpack_surface(texelFetch(surfaces_here, ivec2(at), 0)));
}

// Does this frame show surface s there? Not at an edge. Paths of one surface differ by at most the root of the
// sum of squares of kOneMotionPx and kOneMotion of them: surfaces turn.
bool is_shown(Here here, Surface s) {
    const Surface t = here.surface;
    precise const vec2 da = s.a - t.a;
    return here.inside && !t.edge && one_depth(s.inverse_depth, t.inverse_depth) &&
           precise_dot(da, da) <=
               kOneMotionPx * kOneMotionPx + kOneMotion * kOneMotion * precise_dot(t.a, t.a);
}

// Packs surface s, seen at pixel x of the neighbor. `hidden`: does this frame hide it?
uvec4 pack_of_neighbor(usampler2D surfaces_here, Surface s, ivec2 x, out bool hidden) {
    const uvec4 bits = pack_surface(s);
    s = unpack_surface(bits);
    const Here here = place_of(surfaces_here, s, x);
    hidden = s.inverse_depth >= 0.0 && !is_shown(here, s);
    const bool refuted =
        here.inside && here.surface.inverse_depth * kFarther < s.inverse_depth;
    return refuted ? bits | uvec4(0u, 0u, 0u, kRefuted) : bits;
}
