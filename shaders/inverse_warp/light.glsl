// Compares the light of a neighboring frame with this one's, in cells of kLightCellPx.
//
// FRAME: -1: the frame before, 1: the frame after
#include "inverse_warp/frames.glsl"

const int kLightCellPx = INVERSE_WARP_LIGHT_CELL_PX;
// Paths of one surface differ by at most the root of the sum of squares of these: surfaces turn.
const float kOneMotionPx = 1.0, kOneMotion = 0.5;  // pixels, parts of the path

// Does this frame show surface s, seen at pixel x of the neighbor? Not at an edge. `at`: where
bool shown_here(usampler2D surfaces_here, Surface s, ivec2 x, out ivec2 at) {
    const vec2 place = place_here(s, vec2(x), FRAME);
    at = ivec2(clamp(place, vec2(-1.0), vec2(uniforms.size)));
    if (!inside(at)) return false;
    const Surface t = unpack_surface(texelFetch(surfaces_here, at, 0));
    precise const vec2 da = s.a - t.a;
    return !t.edge && one_depth(s.inverse_depth, t.inverse_depth) &&
           precise_dot(da, da) <=
               kOneMotionPx * kOneMotionPx + kOneMotion * kOneMotion * precise_dot(t.a, t.a);
}

// Does this frame hide surface s, seen at pixel x of the neighbor?
bool is_hidden(usampler2D surfaces_here, Surface s, ivec2 x) {
    ivec2 here;
    return s.inverse_depth >= 0.0 && !shown_here(surfaces_here, s, x, here);
}
