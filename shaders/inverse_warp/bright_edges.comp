#version 450 core
// The surface of bright pixels at edges. Antialiasing mixes the light of a lamp into pixels that
// have the depth of the surface behind it or before it. If the light moved with that surface, it
// would form a rim or a glow: such a pixel shows the lamp's surface.
//
//   color, surfaces, marks -> shown   of squares, two texels: the pixels that show another surface
//                                     than their own; whose it is, two bits each, an index of
//                                     kAround
//
// SPLIT: edges that do not show a lamp are split
#include "common/finite.glsl"
#include "common/software_loop.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"

#include "inverse_warp/half.glsl"
#include "inverse_warp/mixture.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces;
layout(binding = 2) uniform usampler2D marks;
layout(binding = 0) writeonly uniform uimage2D shown;

// A pixel shows the light of an adjacent surface if the pixel is kBrighter times as bright as its
// own surface around it, the other surface is kOtherBrighter times as bright as the pixel, and
// kLampBrighter times as bright as the surface around, and if the two are displaced differently by more than
// kLampApartPx. A pixel with less than kCovered of a surface behind it goes on hiding that surface. A surface
// that is displaced by at most kStaysPx keeps the light of a surface behind it, which is seen through the edge.
//
// A light that goes on for kWidePx is no lamp: pixels at its edge are split (mixed_pixels.comp), if the two
// surfaces part by more than kFarPx of motion.

float largest(vec4 c) {
    return max(c.r, max(c.g, c.b));
}

Surface surface_at(ivec2 p) {
    return unpack_surface(texelFetch(surfaces, in_half(p), 0));
}

float light_at(ivec2 p) {
    return largest(finite_color(texelFetch(color, p, 0)));
}

// Largest component of the mean color of a surface in the pixels around p that show it away from edges; if
// none does, of its darkest pixel there.
float light_around(ivec2 p, Surface own) {
    precise vec4 sum = vec4(0.0);
    precise float count = 0.0;
    float darkest = 3.4e38;
    ivec2 offset = ivec2(-1);
    SOFTWARE_LOOP do {
        const ivec2 at = p + offset;
        const ivec2 read = clamp(at, ivec2(0), uniforms.size - 1);
        const Surface s = surface_at(read);
        const vec4 c = finite_color(texelFetch(color, read, 0));
        const bool same = at == read && one_depth(s.inverse_depth, own.inverse_depth);
        if (same) darkest = min(darkest, largest(c));
        if (same && !s.edge) {
            sum += c;
            count += 1.0;
        }
        offset = offset.x < 1 ? offset + ivec2(1, 0) : ivec2(-1, offset.y + 1);
    } while (offset.y <= 1);
    return count > 0.0 ? largest(sum) / count : darkest;
}

// The lamp beside edge pixel p is seen at the offset kAround[find_lamp()]; -1: there is none.
int find_lamp(ivec2 p, float inverse_depth) {
    const float light = light_at(p);
    float lamp = 0.0;
    int to = -1;
    for (int i = 0; i < 4; ++i) {
        const ivec2 at = p + kAround[i];
        if (!inside(at) || one_depth(surface_at(at).inverse_depth, inverse_depth)) continue;
        const float other = light_at(at);
        if (other <= lamp) continue;
        lamp = other;
        to = i;
    }
    return lamp > kOtherBrighter * light && light > 0.0 ? to : -1;
}

bool hides_and_stays(Surface own, Surface other) {
    return own.inverse_depth > other.inverse_depth && longest_of(own) <= kStaysPx;
}

// Is the light at the offset kAround[to] from p one that goes on?
bool is_wide(ivec2 p, int to) {
    const ivec2 on = clamp(p + kWidePx * kAround[to], ivec2(0), uniforms.size - 1);
    precise const float least = kWide * light_at(p + kAround[to]);
    return light_at(on) >= least;
}

// Do the surfaces leave each other, and the one in front its place, so far that the pixel is split?
bool part_far(Surface s, Surface t) {
    const bool front_leaves = s.inverse_depth > t.inverse_depth ? leaves(s, kFarPx) : leaves(t, kFarPx);
    return front_leaves && part(s, t, kFarPx);
}

// Does pixel p show the lamp seen at the adjacent pixel `at`?
bool shows_lamp(ivec2 p, ivec2 at) {
    const Surface own = surface_at(p), other = surface_at(at);
    const float light = light_at(p), lamp = light_at(at);
    const float around = light_around(p, own);
    if (light <= kBrighter * around || lamp <= kLampBrighter * around) return false;
    precise const float covered = (light - around) / (lamp - around);
    return own.inverse_depth <= other.inverse_depth || covered >= kCovered;
}

// Pixels beside a lamp, of which there are few, are a second list in the upper halves of `list`. The
// lower halves stay for the threads that still read them, by atomics because others write.
//
//    31 30 29 28 27                   16 15  12 11                    0
//   +-----+-----+-----------------------+------+-----------------------+
//   |  0  | to  | item beside a lamp    |  0   | item at an edge       |
//   +-----+-----+-----------------------+------+-----------------------+
//
// to: the lamp is seen at the offset kAround[to]
shared uint lamps;  // length of the second list

shared uint shows_of_square[kSquares], to_of_square[kSquares];

void main() {
    const int first = int(gl_LocalInvocationIndex);
    if (first == 0) lamps = 0u;
    begin_list();
    int k = first;
    SOFTWARE_LOOP do {
        const ivec2 square = square_of(k);
        shows_of_square[k] = to_of_square[k] = 0u;
        add_to_list(k, is_square(square) ? texelFetch(marks, square, 0).x & 0xffffu : 0u);
    } while ((k += kThreads) < kSquares);
    barrier();
    int i = first, end = int(list_length);
    if (i < end) SOFTWARE_LOOP do {
        const uint item = atomicOr(list[i], 0u) & kItem;
        const ivec2 p = pixel_of(item);
        const Surface own = surface_at(p);
        const int to = find_lamp(p, own.inverse_depth);
        const Surface other = surface_at(to < 0 ? p : p + kAround[to]);
        bool differs = apart(other, own) > kLampApartPx * kLampApartPx && !hides_and_stays(own, other);
#if SPLIT
        differs = differs && !(part_far(own, other) && is_wide(p, max(to, 0)));
#endif
        if (to >= 0 && differs)
            atomicOr(list[atomicAdd(lamps, 1u)], (uint(to) << kItemBits | item) << 16);
    } while ((i += kThreads) < end);
    barrier();
    i = first;
    end = int(lamps);
    if (i < end) SOFTWARE_LOOP do {
        const uint both = list[i] >> 16, item = both & kItem, to = both >> kItemBits;
        const ivec2 p = pixel_of(item);
        if (!shows_lamp(p, p + kAround[to])) continue;
        const int square = square_of_item(item);
        atomicOr(shows_of_square[square], bit_of(p));
        atomicOr(to_of_square[square], to << (2 * number_of(p)));
    } while ((i += kThreads) < end);
    barrier();
    k = first;
    SOFTWARE_LOOP do {
        const ivec2 square = square_of(k);
        if (!is_square(square)) continue;
        imageStore(shown, square * ivec2(2, 1), uvec4(shows_of_square[k]));
        imageStore(shown, square * ivec2(2, 1) + ivec2(1, 0), uvec4(to_of_square[k]));
    } while ((k += kThreads) < kSquares);
}
