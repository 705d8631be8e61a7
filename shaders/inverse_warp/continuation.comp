#version 450 core
// Finds the surface that continues behind each cell of 2 px: one seen at one depth and in one color
// on both sides of the cell, along the shortest such line of four. A thread for each cell: on a software
// renderer lists of cells in shared memory took twice as long.
//
//   background_depth, background_color -> background   as background_depth, and for cells of 2 px the
//                                                      line (cells.glsl)
#include "common/software_loop.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/brightness.glsl"
#include "inverse_warp/cells.glsl"
#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform sampler2D background_depth;
layout(binding = 1) uniform sampler2D background_color;
layout(binding = 0) writeonly uniform image2D background;

const int kBlockCells = kBlockPx / 2;
const int kReachBlocks = 2;  // that hold the cells on all lines

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

// A bit for each line that may show something behind inverse depth q on both sides of the cell.
uint find_lines(ivec2 cell, float q) {
    vec4 first, second;
    find_least(cell / kBlockCells, first, second);
    const ivec4 behind = ivec4(lessThan(max(first, second) * kOneDepth, vec4(q)));
    return inside_cells(cell) ? uint(behind.x | behind.y << 1 | behind.z << 2 | behind.w << 3) : 0u;
}

// The first surface behind another one, along a line.
struct Behind {
    int distance;  // for distance_of(); -1: there is none, or it ends before a cell that shows it away from edges
    ivec2 cell;
    float inverse_depth;
};

Behind find_behind(ivec2 cell, ivec2 line, float q) {
    Behind found = Behind(-1, cell, 0.0);
    float behind = -1.0;
    int i = 0;
    bool more;
    SOFTWARE_LOOP do {
        const ivec2 at = cell + distance_of(i) * line;
        const vec2 depth_part = texelFetch(background_depth, nearest_cell(at), 0).xy;
        if (behind < 0.0 && depth_part.x * kOneDepth < q) behind = depth_part.x;
        more = inside_cells(at) && depth_part.y > 0.0 &&
               (behind < 0.0 || one_depth(depth_part.x, behind));
        if (more && behind >= 0.0 && depth_part.y > kShows) {
            found = Behind(i, at, depth_part.x);
            more = false;
        }
        ++i;
    } while (more && i < kDistances);
    return found;
}

// The level around a cell: of its block and those around it.
float find_level(ivec2 cell) {
    precise float roots = 0.0;
    for (int i = 0; i < kAround3x3; ++i) {
        const ivec2 block = cell / kBlockCells + ivec2(i % 3, i / 3) - 1;
        const ivec2 within = clamp(block, ivec2(0), uniforms.blocks - 1);
        roots += mean_root(texelFetch(background_color, first_of_16() + within, 0).rgb);
    }
    return level_of(roots, kContinuedLevel);
}

float largest_of(vec3 v) {
    return max(v.r, max(v.g, v.b));
}

vec3 part_at(ivec2 cell, float level) {
    return as_part_of(texelFetch(background_color, cell, 0).rgb, level);
}

void copy(ivec2 texel) {
    imageStore(background, texel, texelFetch(background_depth, texel, 0));
}

// Is there a larger cell at this distance from the first of 4 px?
bool is_larger_cell(ivec2 texel) {
    const ivec2 blocks = uniforms.blocks;
    const int columns = texel.y < 4 * blocks.y ? 4 : (texel.y < 6 * blocks.y ? 2 : 1);
    return all(lessThan(texel, ivec2(columns, 7) * blocks));
}

const uint kNoLine = 0xffffffffu;

// A line's length, then eight bits (cells.glsl).
uint pack_length(int line, int i, int j) {
    const float length = float(distance_of(i) + distance_of(j)) * precise_length(vec2(line_of(line)));
    return uint(256.0 * length) << 8 | pack_line(line, i, j);
}

// The shortest line on both of whose sides one surface behind inverse depth q is seen, or kNoLine. On a tie
// the first one counts. If the shortest line of all ends at one depth, and is brighter by kLost, none counts: the
// fill keeps its light.
uint find_line(ivec2 cell, float q) {
    uint shortest = kNoLine, found = kNoLine;
    vec3 light = vec3(0.0), found_light = vec3(0.0);
    float level = -1.0;
    uint left = find_lines(cell, q);
    if (left != 0u) SOFTWARE_LOOP do {
        const int way = findLSB(left);
        left &= left - 1u;
        const Behind a = find_behind(cell, line_of(way), q);
        if (a.distance < 0) continue;
        const Behind b = find_behind(cell, -line_of(way), q);
        if (b.distance < 0) continue;
        const uint line = pack_length(way, a.distance, b.distance);
        bool one_surface = one_depth(a.inverse_depth, b.inverse_depth);
        vec3 brighter = vec3(-1.0);  // of both ends, if they have one depth
        if (one_surface) {
            if (level < 0.0) level = find_level(cell);
            const vec3 part_a = part_at(a.cell, level), part_b = part_at(b.cell, level);
            precise const vec3 apart = abs(part_a - part_b);
            one_surface = largest_of(apart) < kOneColor;
            brighter = max(part_a, part_b);
        }
        if (line < shortest) light = brighter;
        shortest = min(shortest, line);
        if (one_surface && line < found) {
            found = line;
            found_light = brighter;
        }
    } while (left != 0u);
    precise const vec3 lost = light - found_light;
    const bool counts = found >> 8 <= uint(kMuchLonger) * (shortest >> 8) && largest_of(lost) <= kLost;
    return counts ? found : kNoLine;
}

void main() {
    const ivec2 cell = invocation_at();
    if (any(greaterThanEqual(cell, kBlockCells * uniforms.blocks))) return;
    if (is_larger_cell(cell)) copy(first_of_4() + cell);
    vec2 depth_part = texelFetch(background_depth, cell, 0).xy;
    const uint line = find_line(cell, depth_part.x);
    if (line != kNoLine) depth_part.y = with_line(depth_part.y, line & 255u);
    imageStore(background, cell, vec4(depth_part, 0.0, 0.0));
}
