#version 450 core
// The light of a neighboring frame beside this one's: a shadow may have moved between them. For each
// patch, the farthest surface that both frames show away from edges.
//
//   color and surfaces of the neighbor, before shown_surfaces.comp; color, surfaces
//       -> light   x: inverse depth, below 0 if there is none; mean brightness, y: in this frame,
//                  z: in the neighbor; w: mean square in this frame
#include "common/finite.glsl"
#include "common/software_loop.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

#include "inverse_warp/brightness.glsl"
#include "inverse_warp/half.glsl"
#include "inverse_warp/light.glsl"

layout(binding = 0) uniform sampler2D color_of_neighbor;
layout(binding = 1) uniform usampler2D surfaces_of_neighbor;
layout(binding = 2) uniform sampler2D color;
layout(binding = 3) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform image2D light;

// The level of a patch: of the pixels in its middle and in the middle of those around it.
float find_level(ivec2 first) {
    precise float roots = 0.0;
    for (int i = 0; i < kAround3x3; ++i) {
        const ivec2 at = first + kLightPatchPx * (ivec2(i % 3, i / 3) - 1) + kLightPatchPx / 2;
        const ivec2 within = clamp(at, ivec2(0), uniforms.size - 1);
        roots += mean_root(finite_color(texelFetch(color, within, 0)).rgb);
    }
    return level_of(roots, kLightLevel);
}

// Mean of red, green and blue.
float brightness(vec4 texel, float level) {
    const vec3 part = as_part_of(max(finite_color(texel).rgb, vec3(0.0)), level);
    precise const float mean = (part.r + part.g + part.b) / 3.0;
    return mean;
}

// Sums over the pixels of a patch that show one surface.
struct LightSums {
    float inverse_depth;  // of the last of them
    float count;
    float here, there, square;
};

void add(precise inout LightSums sums, float inverse_depth, float here, float there) {
    if (inverse_depth > kOneDepth * sums.inverse_depth) return;
    if (kOneDepth * inverse_depth < sums.inverse_depth)
        sums = LightSums(inverse_depth, 0.0, 0.0, 0.0, 0.0);
    sums.inverse_depth = inverse_depth;
    sums.count += 1.0;
    sums.here += here;
    sums.there += there;
    sums.square += here * here;
}

void main() {
    const ivec2 own_patch = invocation_at(), first = kLightPatchPx * own_patch;
    if (any(greaterThanEqual(first, uniforms.size))) return;
    const ivec2 end = min(first + kLightPatchPx, uniforms.size);
    const float level = find_level(first);
    precise LightSums sums = LightSums(3.0e38, 0.0, 0.0, 0.0, 0.0);
    ivec2 there = first;
    SOFTWARE_LOOP do {
        const Surface s = unpack_surface(texelFetch(surfaces_of_neighbor, in_half(there), 0));
        const Here here = place_of(surfaces, s, there);
        if (!s.edge && s.inverse_depth >= 0.0 && is_shown(here, s))
            add(sums, s.inverse_depth, brightness(texelFetch(color, here.at, 0), level),
                brightness(texelFetch(color_of_neighbor, there, 0), level));
        there.x += kLightStepPx;
        if (there.x >= end.x) there = ivec2(first.x, there.y + kLightStepPx);
    } while (there.y < end.y);
    precise const vec3 means = vec3(sums.here, sums.there, sums.square) / max(sums.count, 1.0);
    imageStore(light, own_patch, vec4(sums.count < float(kLightPixels) ? -1.0 : sums.inverse_depth, means));
}
