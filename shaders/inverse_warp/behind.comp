#version 450 core
// Finds the surface that continues behind each cell of 2 px: one seen at one depth and in one color
// on both sides of the cell, nearest along one of four lines.
//
//   background_depth, background_color -> background   as background_depth, and for cells of 2 px:
//                                         zw the cells on both sides; kNoCell if there are none
#include "common/work_group.glsl"

#include "inverse_warp/cells.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D background_depth;
layout(binding = 1) uniform sampler2D background_color;
layout(binding = 0) writeonly uniform uimage2D background;

const int kDistances = 6;
const int kDistance[kDistances] = int[kDistances](1, 2, 3, 5, 9, 16);  // cells
const ivec2 kLines[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1));
const float kShows = 0.3;     // part of a cell: more than its edge pixels
const float kOneColor = 0.25;  // largest difference of c/(1 + c)

bool inside_cells(ivec2 cell) {
    return all(greaterThanEqual(cell, ivec2(0))) &&
           all(lessThan(cell, (uniforms.size + 1) / 2));
}

// The distance, in cells, to the first surface behind inverse depth q: to the first of its cells
// that shows it away from edges. 0: there is none, or it ends before such a cell.
int distance_behind(ivec2 cell, ivec2 line, float q) {
    float behind = -1.0;
    for (int i = 0; i < kDistances; ++i) {
        const ivec2 at = cell + kDistance[i] * line;
        if (!inside_cells(at)) return 0;
        const vec2 depth_part = texelFetch(background_depth, at, 0).xy;
        if (depth_part.y == 0.0) return 0;
        if (behind < 0.0 && depth_part.x * kOneDepth < q) behind = depth_part.x;
        if (behind >= 0.0 && !one_depth(depth_part.x, behind)) return 0;
        if (behind >= 0.0 && depth_part.y > kShows) return kDistance[i];
    }
    return 0;
}

bool one_surface(ivec2 a, ivec2 b) {
    const vec3 color_a = texelFetch(background_color, a, 0).rgb;
    const vec3 color_b = texelFetch(background_color, b, 0).rgb;
    precise const vec3 apart = abs(color_a / (1.0 + abs(color_a)) - color_b / (1.0 + abs(color_b)));
    return one_depth(texelFetch(background_depth, a, 0).x, texelFetch(background_depth, b, 0).x) &&
           max(apart.r, max(apart.g, apart.b)) < kOneColor;
}

uvec2 sides_of(ivec2 cell) {
    const float q = texelFetch(background_depth, cell, 0).x;
    float shortest = 3.0e38;
    uvec2 sides = uvec2(kNoCell);
    for (int i = 0; i < 4; ++i) {
        const ivec2 line = kLines[i];
        const int a = distance_behind(cell, line, q), b = distance_behind(cell, -line, q);
        const float span = float(a + b) * precise_length(vec2(line));
        if (a == 0 || b == 0 || span >= shortest) continue;
        shortest = span;
        const ivec2 at_a = cell + a * line, at_b = cell - b * line;
        sides = one_surface(at_a, at_b) ? uvec2(pack_cell(at_a), pack_cell(at_b)) : uvec2(kNoCell);
    }
    return sides;
}

void main() {
    const ivec2 cell = invocation_at();
    if (any(greaterThanEqual(cell, ivec2(15, 8) * uniforms.blocks))) return;
    const bool has_sides = cell.x < 8 * uniforms.blocks.x && inside_cells(cell);
    imageStore(background, cell,
               uvec4(floatBitsToUint(texelFetch(background_depth, cell, 0).xy),
                     has_sides ? sides_of(cell) : uvec2(kNoCell)));
}
