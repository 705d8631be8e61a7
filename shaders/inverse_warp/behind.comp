#version 450 core
// Finds the surface that continues behind each cell of 2 px: one seen at one depth and in one color
// on both sides of the cell, nearest along one of four lines.
//
//   background_depth, background_color -> background   as background_depth, and for cells of 2 px the
//                                                      line (cells.glsl)
#include "inverse_warp/cells.glsl"
#include "inverse_warp/square.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D background_depth;
layout(binding = 1) uniform sampler2D background_color;
layout(binding = 0) coherent writeonly uniform image2D background;

const int kReachBlocks = 2;    // that hold the cells on all lines
const float kShows = 0.3;      // part of a cell: more than its edge pixels
const float kOneColor = 0.25;  // largest difference of c/(1 + c)

ivec2 cell_of(ivec2 square, int i) {
    return 2 * square + ivec2(i & 1, i >> 1);
}

bool inside_cells(ivec2 cell) {
    return all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, (uniforms.size + 1) / 2));
}

// Which has a texel.
ivec2 nearest_cell(ivec2 cell) {
    return clamp(cell, ivec2(0), 8 * uniforms.blocks - 1);
}

// The least inverse depth in the blocks on both sides, along each line.
void find_least(ivec2 block, out vec4 first, out vec4 second) {
    first = second = vec4(3.0e38);
    for (int y = -kReachBlocks; y <= kReachBlocks; ++y) {
        for (int x = -kReachBlocks; x <= kReachBlocks; ++x) {
            const ivec2 at = clamp(block + ivec2(x, y), ivec2(0), uniforms.blocks - 1);
            const float q = texelFetch(background_depth, first_of_16() + at, 0).x;
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
uint find_lines(ivec2 square) {
    vec4 first, second;
    find_least(kSquarePx * square / kBlockPx, first, second);
    uint lines = 0u;
    for (int i = 0; i < 4; ++i) {
        const ivec2 cell = cell_of(square, i);
        const float q = texelFetch(background_depth, cell, 0).x;
        const ivec4 behind = ivec4(lessThan(max(first, second) * kOneDepth, vec4(q)));
        if (inside_cells(cell))
            lines |= uint(behind.x | behind.y << 1 | behind.z << 2 | behind.w << 3) << (4 * i);
    }
    return lines;
}

// The number of the distance to the first surface behind inverse depth q: to the first of its cells
// that shows it away from edges. -1: there is none, or it ends before such a cell.
int find_behind(ivec2 cell, ivec2 line, float q) {
    float behind = -1.0;
    int found = -1, i = 0;
    bool more;
    do {
        const ivec2 at = cell + distance_of(i) * line;
        const vec2 depth_part = texelFetch(background_depth, nearest_cell(at), 0).xy;
        if (behind < 0.0 && depth_part.x * kOneDepth < q) behind = depth_part.x;
        more = inside_cells(at) && depth_part.y > 0.0 &&
               (behind < 0.0 || one_depth(depth_part.x, behind));
        if (more && behind >= 0.0 && depth_part.y > kShows) {
            found = i;
            more = false;
        }
        ++i;
    } while (more && i < kDistances);
    return found;
}

bool one_surface(ivec2 a, ivec2 b) {
    const vec3 color_a = texelFetch(background_color, a, 0).rgb;
    const vec3 color_b = texelFetch(background_color, b, 0).rgb;
    precise const vec3 apart = abs(color_a / (1.0 + abs(color_a)) - color_b / (1.0 + abs(color_b)));
    return one_depth(texelFetch(background_depth, a, 0).x, texelFetch(background_depth, b, 0).x) &&
           max(apart.r, max(apart.g, apart.b)) < kOneColor;
}

void copy(ivec2 texel) {
    imageStore(background, texel, texelFetch(background_depth, texel, 0));
}

// For each cell of the work group, the shortest line on both of whose sides a surface is seen behind it:
// its length, then eight bits (cells.glsl). On a tie the first line counts.
shared uint shortest[4 * kSquares];
const uint kNoLine = 0xffffffffu;

// Four bits for each line of each cell: the number of the distance on its first side.
shared uint first_distances[2 * kSquares];

uint pack_length(int line, int i, int j) {
    const float length = float(distance_of(i) + distance_of(j)) * precise_length(vec2(line_of(line)));
    return uint(256.0 * length) << 8 | pack_line(line, i, j);
}

bool is_of_cells(ivec2 square) {
    return all(lessThan(square, 4 * uniforms.blocks));
}

void copy_cells(ivec2 square) {
    for (int i = 0; i < 4; ++i) copy(cell_of(square, i));
    copy(first_of_4() + square);
    if (all(lessThan(square, 2 * uniforms.blocks))) copy(first_of_8() + square);
    if (all(lessThan(square, uniforms.blocks))) copy(first_of_16() + square);
}

void main() {
    const int thread = int(gl_LocalInvocationIndex);
    for (int k = thread; k < kSquares; k += kThreads) {
        const ivec2 square = square_of(k);
        bits_of_square[k] = first_distances[2 * k] = first_distances[2 * k + 1] = 0u;
        for (int i = 0; i < 4; ++i) shortest[4 * k + i] = kNoLine;
        if (!is_of_cells(square)) continue;
        copy_cells(square);
        bits_of_square[k] = find_lines(square);
    }
    memoryBarrierImage();  // some of these cells are stored again below, by another thread
    // First the lines that show something on their first side.
    make_list();
    for (int i = thread; i < int(list_length); i += kThreads) {
        const int k = int(list[i] >> 4), bit = bit_in_list(i);
        const ivec2 cell = cell_of(square_of(k), bit >> 2);
        const float q = texelFetch(background_depth, cell, 0).x;
        const int first = find_behind(cell, line_of(bit & 3), q);
        if (first < 0)
            atomicAnd(bits_of_square[k], ~(1u << bit));
        else
            atomicOr(first_distances[2 * k + (bit >> 3)], uint(first) << (4 * (bit & 7)));
    }
    barrier();
    make_list();
    for (int i = thread; i < int(list_length); i += kThreads) {
        const int k = int(list[i] >> 4), bit = bit_in_list(i);
        const ivec2 cell = cell_of(square_of(k), bit >> 2), line = line_of(bit & 3);
        const float q = texelFetch(background_depth, cell, 0).x;
        const int second = find_behind(cell, -line, q);
        if (second < 0) continue;
        const int first = int(first_distances[2 * k + (bit >> 3)] >> (4 * (bit & 7)) & 7u);
        atomicMin(shortest[4 * k + (bit >> 2)], pack_length(bit & 3, first, second));
    }
    barrier();
    for (int k = thread; k < kSquares; k += kThreads) {
        uint cells = 0u;
        for (int i = 0; i < 4; ++i)
            if (shortest[4 * k + i] != kNoLine) cells |= 1u << i;
        bits_of_square[k] = cells;
    }
    make_list();
    for (int i = thread; i < int(list_length); i += kThreads) {
        const int k = int(list[i] >> 4), n = bit_in_list(i);
        const ivec2 cell = cell_of(square_of(k), n);
        const uint line = shortest[4 * k + n] & 255u;
        const uvec2 sides = sides_on(line, cell);
        if (!one_surface(unpack_cell(sides.x), unpack_cell(sides.y))) continue;
        const vec2 depth_part = texelFetch(background_depth, cell, 0).xy;
        imageStore(background, cell,
                   vec4(depth_part.x, with_line(depth_part.y, line), 0.0, 0.0));
    }
}
