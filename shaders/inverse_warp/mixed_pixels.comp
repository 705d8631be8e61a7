#version 450 core
// The pixels at depth edges whose surface is behind another one, which is mixed into them. One that is mostly
// the surface in front shows that surface and keeps its mixture, the antialiased outline. If the surface in
// front stays in place, less of it is enough. The others take the color of a pixel that shows their own surface
// alone. A thin surface in front shows nowhere alone: its color is the one that differs most from the other's.
// If the surface in front stays in place, and the pixel's motion vector is an average of both, that tells their
// parts: the pixel shows the surface behind, and the gather lays the part of the one in front over it.
//
//   color, surfaces, marks, shown [, motion] -> mixed   of pixels at edges: 0, or kMixed, places and further
//                                                       bits
#include "common/finite.glsl"
#include "common/software_loop.glsl"

#include "inverse_warp/around.glsl"
#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"

#include "inverse_warp/mixture.glsl"
#include "inverse_warp/split_edges.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform usampler2D surfaces;
#if SHUTTER
layout(binding = 4) uniform sampler2D motion;
#endif
layout(binding = 0) writeonly uniform uimage2D mixed;

// A pixel is a mixture if its color differs from one by at most kRest, and the colors of both surfaces by
// more than kContrast. It shows the surface in front if it has less than most_own() of its own. A surface has
// the color of the pixel that shows it alone and is closest to the pixel's color, among those up to kSlackPx2
// farther than the nearest.
//
// A pixel of the surface in front whose motion is a mixture takes the surface of the pixel that shows it alone.
const int kNone = 1000;

// The pixels around, nearest first.
const int kOffsets = 24, kAdjacent = 8;
const ivec2 kOffset[kOffsets] = ivec2[kOffsets](
    ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1), ivec2(-1, -1), ivec2(1, -1), ivec2(-1, 1),
    ivec2(1, 1), ivec2(-2, 0), ivec2(2, 0), ivec2(0, -2), ivec2(0, 2), ivec2(-2, -1), ivec2(2, -1),
    ivec2(-2, 1), ivec2(2, 1), ivec2(-1, -2), ivec2(1, -2), ivec2(-1, 2), ivec2(1, 2), ivec2(-2, -2),
    ivec2(2, -2), ivec2(-2, 2), ivec2(2, 2));

// A surface beside the pixel.
struct Side {
    ivec2 offset;  // to the pixel that has its color
    vec3 color;
    float inverse_depth;
    float off;  // squared difference of its color to the one that it shall be close to
    int reach;  // px^2, of the pixels that count; kNone: none shows it alone
    vec3 sum;   // over all pixels that show it alone
    float count;
};

Surface surface_at(ivec2 p) {
    return unpack_surface(texelFetch(surfaces, p, 0));
}

vec3 color_of(ivec2 p) {
    return finite_color(texelFetch(color, p, 0)).rgb;
}

#if SHUTTER
vec2 motion_at(ivec2 p) {
    const vec2 m = texelFetch(motion, p, 0).xy;
    return is_finite(vec4(m, m)) ? clamp(m, vec2(-1e15), vec2(1e15)) : vec2(0.0);
}
#endif

int squared(ivec2 offset) {
    return offset.x * offset.x + offset.y * offset.y;
}

void add_alone(precise inout Side side, ivec2 offset, float inverse_depth, vec3 seen, vec3 own) {
    if (side.reach == kNone) {
        side.reach = squared(offset) + kSlackPx2;
        side.inverse_depth = inverse_depth;
    }
    if (!one_depth(inverse_depth, side.inverse_depth)) return;
    side.sum += seen;
    side.count += 1.0;
    precise const vec3 to = seen - own;
    const float off = precise_dot(to, to);
    if (squared(offset) > side.reach || off >= side.off) return;
    side.offset = offset;
    side.color = seen;
    side.off = off;
}

// The color of `front`, a surface that shows nowhere alone, and beside it the one of `back`, the pixel's
// own, that is closest to its mean. False: no adjacent pixel shows the front.
bool find_thin(ivec2 p, vec3 own, inout Side front, inout Side back) {
    precise const vec3 mean = back.sum / back.count, way = own - mean;
    float most = -1.0;
    back.off = 3.4e38;
    int i = 0;
    SOFTWARE_LOOP do {
        const ivec2 offset = kOffset[i], at = p + offset, read = clamp(at, ivec2(0), uniforms.size - 1);
        const Surface s = surface_at(read);
        const vec3 seen = color_of(read);
        precise const vec3 to = seen - mean;
        const float along = precise_dot(to, way), off = precise_dot(to, to);
        if (at == read && i < kAdjacent && one_depth(s.inverse_depth, front.inverse_depth) &&
            along > most) {
            most = along;
            front.offset = offset;
            front.color = seen;
        }
        if (at == read && !s.edge && one_depth(s.inverse_depth, back.inverse_depth) &&
            squared(offset) <= back.reach && off < back.off) {
            back.off = off;
            back.offset = offset;
            back.color = seen;
        }
    } while (++i < kOffsets);
    return most >= 0.0;
}

// A pixel with less of its own surface shows the one in front.
float most_own(Surface front, Surface back) {
    if (abs(front.radius) > kLensPartPx) return kMostLeaving;
    if (!kShutter) return kMostStillLens;
    const float px = sqrt(apart(front, back));
    precise const float slow = clamp((kFastPx - px) / kSlowerPx, 0.0, 1.0);
    const float most = precise_mix(kMostLeaving, kMostSlow, slow);
    return path_of(front) > kPartPx ? most : max(most, kMostStill);
}

// Does an outline's pixel move as a mixture of its own surface and of the one behind?
bool mixes_motion(Surface own, Surface front, Surface back) {
    const float between = apart_by_motion(front, back);
    precise const float least = kRest * kRest * between;
    return kShutter && between > kPartPx * kPartPx && apart_by_motion(own, front) > least;
}

// The part of the surface in front in pixel p, if it stays in place and the one behind leaves, by the motion
// vector, which a renderer averages; otherwise 0. The offsets: to pixels that show them alone.
float part_in_front(ivec2 p, ivec2 to_front, ivec2 to_back) {
    precise float part = 0.0;
#if SHUTTER
    const Surface front = surface_at(p + to_front), back = surface_at(p + to_back);
    if (longest_of(front) > kPartPx || !(apart_by_motion(front, back) > kPartPx * kPartPx)) return 0.0;
    const vec2 behind = motion_at(p + to_back);
    precise const vec2 own = motion_at(p) - behind, way = motion_at(p + to_front) - behind;
    part = precise_dot(own, way) / max(precise_dot(way, way), 1e-30);
    precise const float left = 1.0 - part;
    if (!(min(part, left) >= kLeastPart)) part = 0.0;
#endif
    return part;
}

// The word of pixel p.
uint word_of(ivec2 p) {
    const Surface own = surface_at(p);
    const vec3 c = color_of(p);
    Side same = Side(ivec2(0), c, own.inverse_depth, 3.4e38, kNone, vec3(0.0), 0.0);
    Side other = Side(ivec2(0), c, kNotThere, 3.4e38, kNone, vec3(0.0), 0.0);
    float mixed_depth = kNotThere;  // of the nearest pixel at an edge that shows another surface
    int i = 0;
    SOFTWARE_LOOP do {
        const ivec2 at = p + kOffset[i], read = clamp(at, ivec2(0), uniforms.size - 1);
        const Surface s = surface_at(read);
        const vec3 seen = color_of(read);
        const bool is_same = one_depth(s.inverse_depth, own.inverse_depth);
        if (at == read && !s.edge && is_same) add_alone(same, kOffset[i], own.inverse_depth, seen, c);
        if (at == read && !s.edge && !is_same) add_alone(other, kOffset[i], s.inverse_depth, seen, c);
        if (at == read && s.edge && !is_same && mixed_depth == kNotThere) mixed_depth = s.inverse_depth;
    } while (++i < kOffsets);

    const bool thin = other.reach == kNone;
    if (thin) other.inverse_depth = mixed_depth;
    if (same.reach == kNone) return 0u;
    const bool in_front = other.inverse_depth <= own.inverse_depth;
    const ivec2 to_front = in_front ? same.offset : other.offset;
    const ivec2 to_back = in_front ? other.offset : same.offset;
    const float part_held = thin ? 0.0 : part_in_front(p, to_front, to_back);
    precise const float parts = kParts * part_held + 0.5;
    if (part_held > 0.0)
        return kMixed | kHolds | place_of(to_back) | place_of(to_front) << kFrontShift |
               uint(parts) << kPartsShift;
    if (in_front) {
        const bool mixes =
            !thin && mixes_motion(own, surface_at(p + same.offset), surface_at(p + other.offset));
        return mixes ? kMixed | kTakes | place_of(same.offset) : 0u;
    }
    if (thin && !find_thin(p, c, other, same)) return 0u;
    precise const vec3 way = same.color - other.color;
    const float contrast = precise_dot(way, way);
    precise const float least =
        kContrast * kContrast *
        max(precise_dot(same.color, same.color), precise_dot(other.color, other.color));
    if (contrast <= least) return 0u;
    precise const float share = precise_dot(c - other.color, way) / contrast;
    precise const vec3 rest = c - other.color - share * way;
    precise const float most_rest = kRest * kRest * contrast;
    const Surface front = surface_at(p + other.offset), back = surface_at(p + same.offset);
    const bool takes = share < most_own(front, back);
    if (share < (thin ? kLeastShareThin : kLeastShare) || share > kMostShare ||
        precise_dot(rest, rest) > most_rest || !part(back, front, kPartPx))
        return 0u;
    if (takes) return kMixed | kTakes | place_of(other.offset);
    return MOTION == 1 ? kMixed | place_of(same.offset) : 0u;  // a surface without motion holds no place
}

void main() {
    const int first = int(gl_LocalInvocationIndex);
    list_edges();
    int i = first;
    const int end = int(list_length);
    if (i < end) SOFTWARE_LOOP do {
        const ivec2 p = pixel_of(list[i]);
        imageStore(mixed, p, uvec4(word_of(p)));
    } while ((i += kThreads) < end);
}
