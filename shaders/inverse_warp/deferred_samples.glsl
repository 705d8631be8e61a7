// Samples that the search of this frame does not settle are deferred until all samples of a set have
// searched: the lanes whose samples are settled do not wait for the others. Two words a sample store
// the search's result; the surface at the stored pixel restores it.

const int kMaxDeferred = 32;
const uint kShown = 1u << 16, kBeyond = 1u << 17, kShowsBehind = 1u << 18;
const uint kAtX = 1u << 19, kAtY = 1u << 20;  // the color is read at the pixel along this axis
const int kNumber = 21;                       // its first bit

// Does the search of this frame settle what the sample sees? Not if it found nothing, or if this
// frame may hide a nearer start surface that a neighbor or the layer behind shows, or that
// continues behind.
bool is_settled(Sample now, Search here) {
    precise const float nearest =
        here.nearest.inverse_depth * (kSearchedOutside ? now.depth_ratio : kOneDepth);
    return nearest >= 0.0 && here.deferred_for <= nearest;
}

// x: the pixel that shows the nearest surface; if none, the farthest. y: eight occluded starts,
// eight hidden ones, the bits above, the sample's number.
uvec2 pack_search(int number, Search here) {
    const bool shown = here.nearest.inverse_depth >= 0.0;
    const uint bits = here.starts | (shown ? kShown : 0u) |
                      (here.nearest.beyond ? kBeyond : 0u) |
                      (here.nearest.at.x == here.nearest_at.x ? kAtX : 0u) |
                      (here.nearest.at.y == here.nearest_at.y ? kAtY : 0u) |
                      (here.shows_behind ? kShowsBehind : 0u) | uint(number) << kNumber;
    return uvec2(pack_cell(ivec2(shown ? here.nearest_at : here.far_at)), bits);
}

int number_of_search(uvec2 words) {
    return int(words.y >> kNumber);
}

Search unpack_search(uvec2 words, Pixel pixel, Sample now) {
    const vec2 at = vec2(unpack_cell(words.x));
    const uvec4 stored = texelFetch(surfaces, ivec2(at), 0);
    const Surface surface = unpack_surface(stored);
    const uint bits = words.y, place = place_in(stored);
    Search here = begin_search(pixel, surface);
    if ((bits & kShown) != 0u) {
        here.nearest = found_at(at, surface, displacement(surface, now), (bits & kBeyond) != 0u,
                                pixel.p);
        if ((bits & kAtX) != 0u) here.nearest.at.x = at.x;
        if ((bits & kAtY) != 0u) here.nearest.at.y = at.y;
        if (place != kOwnPlace) here.nearest.at = beside(at, place);
    }
    here.far = surface;
    here.far_at = at;
    here.shows_behind = (bits & kShowsBehind) != 0u;
    here.starts = bits & 0xffffu;
    return here;
}
