#version 450 core
// A pixel beside a lamp gets the surface that it shows (bright_edges.comp), and an edge to the adjacent pixels
// that show another. All other pixels keep their surfaces.
//
//   inverse_depth [, motion [, motion_back [, both of the neighbors]]], shown -> surfaces
//
// NEIGHBOR: of the frame before or after. Surfaces that this frame hides are marked if the light around
// them has changed: surfaces of this frame, light, marks -> surfaces
#include "common/software_loop.glsl"

#include "inverse_warp/planes.glsl"

#include "inverse_warp/half.glsl"
#include "inverse_warp/square.glsl"

layout(binding = 3) uniform usampler2D shown;
layout(binding = 0) coherent writeonly uniform uimage2D surfaces;
#if NEIGHBOR
layout(binding = 4) uniform usampler2D surfaces_here;
layout(binding = 5) uniform sampler2D light;
layout(binding = 6) uniform usampler2D marks;

#include "inverse_warp/light.glsl"

// This frame hides a surface of this inverse depth, seen at p. Does the light around it differ from
// this frame's? That is, in the patches around that show it, of the smallest ring that has some, the
// brightness differs by more than its deviation there: a fill that shows the surface errs less.
bool has_other_light(ivec2 p, float inverse_depth) {
    const ivec2 own_patch = p / kLightPatchPx;
    const ivec2 last = (uniforms.size - 1) / kLightPatchPx;
    precise float count = 0.0, mean = 0.0, square = 0.0, difference = 0.0;
    int ring = 0;
    ivec2 offset = ivec2(0);
    // One loop over the patches of all rings; it ends after the first ring that shows the surface.
    SOFTWARE_LOOP do {
        const ivec2 at = own_patch + offset;
        const bool within = all(greaterThanEqual(at, ivec2(0))) && all(lessThanEqual(at, last));
        const vec4 l = texelFetch(light, clamp(at, ivec2(0), last), 0);
        if (within && l.x >= 0.0 && one_depth(l.x, inverse_depth)) {
            count += 1.0;
            mean += l.y;
            square += l.w;
            difference += (l.z - l.y) * (l.z - l.y);
        }
        // Between the left and the right column of a ring only its first and last row.
        offset.x += abs(offset.y) == ring || ring == 0 ? 1 : 2 * ring;
        if (offset.x > ring) offset = ivec2(-ring, offset.y + 1);
        if (offset.y > ring && count == 0.0) {
            ++ring;
            offset = ivec2(-ring);
        }
    } while (offset.y <= ring && ring <= kLightRings);
    if (count == 0.0) return false;
    mean /= count;
    precise const float variance = max(square / count - mean * mean, 0.0);
    return difference / count > variance + kLightDifference;
}

shared uint hidden_of_square[kSquares];

// The hidden pixels of a square, if some patch around it has another brightness; otherwise none.
uint hidden_in_other_light(ivec2 square, uint hidden) {
    const ivec2 own_patch = kSquarePx * square / kLightPatchPx;
    const ivec2 last = (uniforms.size - 1) / kLightPatchPx;
    bool differs = false, more = hidden != 0u;
    ivec2 offset = ivec2(-kLightRings);
    SOFTWARE_LOOP do {
        const vec4 l = texelFetch(light, clamp(own_patch + offset, ivec2(0), last), 0);
        differs = differs || (l.x >= 0.0 && (l.z - l.y) * (l.z - l.y) > 0.99 * kLightDifference);
        offset = offset.x < kLightRings ? offset + ivec2(1, 0) : ivec2(-kLightRings, offset.y + 1);
        more = more && !differs && offset.y <= kLightRings;
    } while (more);
    return differs ? hidden : 0u;
}
#endif

// The pixels of the square that show another surface than their own.
uint changed_in(ivec2 square) {
    return is_square(square) ? texelFetch(shown, square * ivec2(2, 1), 0).x & 0xffffu : 0u;
}

// They and the pixels next to them (bits: square.glsl).
uint near_changed(ivec2 square) {
    const uint own = changed_in(square);
    return own | (own & 0x7777u) << 1 | (own & 0xeeeeu) >> 1 | (own << 4 & 0xffffu) | own >> 4 |
           (changed_in(square - ivec2(1, 0)) & 0x8888u) >> 3 |
           (changed_in(square + ivec2(1, 0)) & 0x1111u) << 3 |
           changed_in(square - ivec2(0, 1)) >> 12 | (changed_in(square + ivec2(0, 1)) & 0xfu) << 12;
}

// The adjacent pixel whose surface p shows, otherwise p.
ivec2 shown_at(ivec2 p) {
    const ivec2 words = (p / kSquarePx) * ivec2(2, 1);
    if ((texelFetch(shown, words, 0).x & bit_of(p)) == 0u) return p;
    const uint to = texelFetch(shown, words + ivec2(1, 0), 0).x;
    return nearest_inside(p + kAround[to >> (2 * number_of(p)) & 3u]);
}

// Does depth jump from p, with this inverse depth, to an adjacent pixel that shows another surface
// than its own?
bool is_edge(ivec2 p, float inverse_depth) {
    bool edge = false;
    uint left = 15u;
    SOFTWARE_LOOP do {
        const ivec2 at = nearest_inside(p + kAround[findLSB(left)]), from = shown_at(at);
        edge = at != from && !one_depth(stored_depth_at(from), inverse_depth);
        left &= left - 1u;
    } while (!edge && left != 0u);
    return edge;
}

// The surface that pixel p shows.
Surface shown_surface(ivec2 p) {
    Surface s = surface_at(shown_at(p));
    const bool edge = is_edge(p, inverse_depth_of(floatBitsToUint(s.inverse_depth)));
    s.edge = s.edge || edge;
    return s;
}

// `list` holds items alone (square.glsl): first the pixels that have changed or are beside one that
// has, then those of a neighbor that this frame hides and whose light may differ.
void main() {
    const int first = int(gl_LocalInvocationIndex);
    begin_list();
    int k = first;
    SOFTWARE_LOOP do {
        const ivec2 square = square_of(k);
        add_to_list(k, is_square(square) ? near_changed(square) : 0u);
#if NEIGHBOR
        hidden_of_square[k] = is_square(square) ? texelFetch(marks, square, 0).x >> 16 : 0u;
#endif
    } while ((k += kThreads) < kSquares);
    barrier();
    int i = first, end = int(list_length);
    if (i < end) SOFTWARE_LOOP do {
        const uint item = list[i];
        const ivec2 p = pixel_of(item);
        if (!inside(p)) continue;
        const Surface s = shown_surface(p);
#if NEIGHBOR
        bool hidden;
        const uvec4 bits = pack_of_neighbor(surfaces_here, s, p, hidden);
        const int square = square_of_item(item);
        atomicAnd(hidden_of_square[square], ~bit_of(p));
        if (hidden) atomicOr(hidden_of_square[square], bit_of(p));
#else
        const uvec4 bits = pack_surface(s);
#endif
        imageStore(surfaces, in_half(p), bits);
    } while ((i += kThreads) < end);
#if NEIGHBOR
    memoryBarrierImage();  // another thread may store some of these pixels again
    barrier();
    begin_list();
    k = first;
    SOFTWARE_LOOP do add_to_list(k, hidden_in_other_light(square_of(k), hidden_of_square[k]));
    while ((k += kThreads) < kSquares);
    barrier();
    i = first;
    end = int(list_length);
    if (i < end) SOFTWARE_LOOP do {
        const ivec2 p = pixel_of(list[i]);
        if (!has_other_light(p, stored_depth_at(shown_at(p)))) continue;
        bool hidden;
        const uvec4 bits = pack_of_neighbor(surfaces_here, shown_surface(p), p, hidden);
        imageStore(surfaces, in_half(p), in_other_light(bits));
    } while ((i += kThreads) < end);
#endif
}
