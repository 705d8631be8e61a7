#version 450 core
// Finds the surface that continues behind each cell of 2 px: one seen at one depth and in one color
// on both sides of the cell, nearest along one of four lines. A thread for four cells.
//
//   background_depth, background_color -> background   as background_depth, and for cells of 2 px:
//                                         zw the cells on both sides; kNoCell if there are none
#include "inverse_warp/cells.glsl"
#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D background_depth;
layout(binding = 1) uniform sampler2D background_color;
layout(binding = 0) writeonly uniform uimage2D background;

// Distances along a line, cells: five bits each.
const int kDistances = 6;
const uint kDistance = 1u | 2u << 5 | 3u << 10 | 5u << 15 | 9u << 20 | 16u << 25;
const int kReachBlocks = 2;    // that holds all of them
const float kShows = 0.3;      // part of a cell: more than its edge pixels
const float kOneColor = 0.25;  // largest difference of c/(1 + c)

ivec2 cell_of(ivec2 square, int i) {
    return 2 * square + ivec2(i & 1, i >> 1);
}

bool inside_cells(ivec2 cell) {
    return all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, (uniforms.size + 1) / 2));
}

int distance_of(int i) {
    return int(kDistance >> (5 * i) & 31u);
}

// Horizontal, vertical and both diagonals.
ivec2 line_of(int line) {
    return ivec2(line == 1 ? 0 : 1, line == 0 ? 0 : (line == 3 ? -1 : 1));
}

// The line, and the distances along it, on which both sides of a cell show what is behind. Never 0.
int pack_sides(int line, int i, int j) {
    return line | i << 2 | (j + 1) << 5;
}
ivec2 first_side(ivec2 cell, int sides) {
    return cell + distance_of(sides >> 2 & 7) * line_of(sides & 3);
}
ivec2 second_side(ivec2 cell, int sides) {
    return cell - distance_of((sides >> 5) - 1) * line_of(sides & 3);
}

// The least inverse depth in the blocks on both sides, along each line.
void find_least(ivec2 block, out vec4 first, out vec4 second) {
    first = second = vec4(3.0e38);
    for (int y = -kReachBlocks; y <= kReachBlocks; ++y) {
        for (int x = -kReachBlocks; x <= kReachBlocks; ++x) {
            const ivec2 at = clamp(block + ivec2(x, y), ivec2(0), uniforms.blocks - 1);
            const float q =
                texelFetch(background_depth, at + ivec2(14 * uniforms.blocks.x, 0), 0).x;
            if (y == 0 && x >= 0) first.x = min(first.x, q);
            if (y == 0 && x <= 0) second.x = min(second.x, q);
            if (x == 0 && y >= 0) first.y = min(first.y, q);
            if (x == 0 && y <= 0) second.y = min(second.y, q);
            if (x >= 0 && y >= 0) first.z = min(first.z, q);
            if (x <= 0 && y <= 0) second.z = min(second.z, q);
            if (x >= 0 && y <= 0) first.w = min(first.w, q);
            if (x <= 0 && y >= 0) second.w = min(second.w, q);
        }
    }
}

// Four bits for each cell of the square: lines that may show something behind it on both sides.
uint find_lines(ivec2 square, vec4 cells) {
    vec4 first, second;
    find_least(kSquarePx * square / kBlockPx, first, second);
    uint lines = 0u;
    for (int i = 0; i < 4; ++i) {
        const ivec2 cell = cell_of(square, i);
        const ivec4 behind = ivec4(lessThan(max(first, second) * kOneDepth, vec4(cells[i])));
        if (inside_cells(cell))
            lines |= uint(behind.x | behind.y << 1 | behind.z << 2 | behind.w << 3) << (4 * i);
    }
    return lines;
}

// For each cell of the square, whose inverse depths are `cells`, eight bits: the shortest of the lines
// on both of whose sides a surface behind the cell is seen; 0: there is none. On a side it is the
// first one behind. The distance is that to the first of its cells that shows it away from edges, with
// no other surface before.
uint find_sides(ivec2 square, vec4 cells) {
    uint lines = find_lines(square, cells);
    uint all_sides = 0u;
    float shortest = 3.0e38;
    int of_cell = -1;  // `shortest`
    int i = 0, first = -1;  // distance; distance on the first side, -1: not yet known
    float behind = -1.0;
    // One loop over the distances of all lines.
    while (lines != 0u) {
        const int item = findLSB(lines), n = item >> 2;
        const ivec2 cell = cell_of(square, n), line = line_of(item & 3);
        const ivec2 at = cell + distance_of(i) * (first < 0 ? line : -line);
        const vec2 depth_part = texelFetch(background_depth, max(at, ivec2(0)), 0).xy;
        const vec2 column = (n & 1) == 0 ? cells.xz : cells.yw;
        const float q = (n & 2) == 0 ? column.x : column.y;
        if (behind < 0.0 && depth_part.x * kOneDepth < q) behind = depth_part.x;
        bool ends = !inside_cells(at) || depth_part.y == 0.0 ||
                    (behind >= 0.0 && !one_depth(depth_part.x, behind));
        if (!ends && behind >= 0.0 && depth_part.y > kShows) {
            if (first < 0) {
                first = i;
                i = -1;
                behind = -1.0;
            } else {
                if (n != of_cell) shortest = 3.0e38;
                of_cell = n;
                const float span = float(distance_of(first) + distance_of(i)) *
                                   precise_length(vec2(line));
                if (span < shortest) {
                    shortest = span;
                    all_sides = (all_sides & ~(255u << (8 * n))) |
                                uint(pack_sides(item & 3, first, i)) << (8 * n);
                }
                ends = true;
            }
        }
        ++i;
        if (ends || i == kDistances) {
            lines &= lines - 1u;
            i = 0;
            first = -1;
            behind = -1.0;
        }
    }
    return all_sides;
}

bool one_surface(ivec2 a, ivec2 b) {
    const vec3 color_a = texelFetch(background_color, a, 0).rgb;
    const vec3 color_b = texelFetch(background_color, b, 0).rgb;
    precise const vec3 apart = abs(color_a / (1.0 + abs(color_a)) - color_b / (1.0 + abs(color_b)));
    return one_depth(texelFetch(background_depth, a, 0).x, texelFetch(background_depth, b, 0).x) &&
           max(apart.r, max(apart.g, apart.b)) < kOneColor;
}

void store(ivec2 cell, vec2 depth_part, uvec2 sides) {
    imageStore(background, cell, uvec4(floatBitsToUint(depth_part), sides));
}

void copy(ivec2 cell) {
    store(cell, texelFetch(background_depth, cell, 0).xy, uvec2(kNoCell));
}

void main() {
    const ivec2 square = invocation_at();
    if (any(greaterThanEqual(square, 4 * uniforms.blocks))) return;
    vec4 cells;
    for (int i = 0; i < 4; ++i) {
        const vec2 depth_part = texelFetch(background_depth, cell_of(square, i), 0).xy;
        cells[i] = depth_part.x;
        store(cell_of(square, i), depth_part, uvec2(kNoCell));
    }
    // Larger cells, edge to edge to the right of these.
    copy(square + ivec2(8 * uniforms.blocks.x, 0));
    if (all(lessThan(square, 2 * uniforms.blocks))) copy(square + ivec2(12 * uniforms.blocks.x, 0));
    if (all(lessThan(square, uniforms.blocks))) copy(square + ivec2(14 * uniforms.blocks.x, 0));
    // Those behind which a surface continues, once more.
    uint all_sides = find_sides(square, cells);
    for (int i = 0; all_sides != 0u; ++i) {
        const ivec2 cell = cell_of(square, i);
        const int sides = int(all_sides & 255u);
        all_sides >>= 8;
        if (sides == 0) continue;
        const ivec2 a = first_side(cell, sides), b = second_side(cell, sides);
        if (one_surface(a, b))
            store(cell, texelFetch(background_depth, cell, 0).xy, uvec2(pack_cell(a), pack_cell(b)));
    }
}
