// Times and places of a neighboring frame as seen from this one. frame: -1: before, 1: after.

// The sample's time as seen from another frame.
Sample seen_from(int frame, Sample at) {
    precise const float u = at.u - float(frame) * (1.0 / uniforms.half_shutter);
    at.u = u;
    at.bend = bend_at(at.u);
    return at;
}

// The pixel of this frame at which surface s is, seen at pixel x of a neighbor; it may lie beyond
// the frame.
vec2 place_here(Surface s, vec2 x, int frame) {
    Sample here;
    here.u = 0.0;
    precise const vec2 at = floor(x + moved(s, seen_from(frame, here)) + 0.5);
    return at;
}
