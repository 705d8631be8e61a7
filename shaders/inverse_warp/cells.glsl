// Cells of the background. Those of 2 px take 8 x 8 texels for each block, and the larger ones stand to
// the right of these, edge to edge: those of 4 px, below them those of 8 px, below them those of 16 px.
//
// Beside a cell of 2 px two others may show, on both sides of it, the surface that continues behind it:
// on one of four lines, each at one of six distances.
#include "shared/inverse_warp_uniforms.h"

const uint kNoCell = 0xffffffffu;

// Two cells of 2 px in two words.
uint pack_cell(ivec2 cell) {
    return uint(cell.x) | (uint(cell.y) << 16);
}

ivec2 unpack_cell(uint bits) {
    return ivec2(bits & 0xffffu, bits >> 16);
}

// The texel of the first cell of 4, 8 or 16 px.
ivec2 first_of_4() {
    return ivec2(8, 0) * uniforms.blocks;
}
ivec2 first_of_8() {
    return ivec2(8, 4) * uniforms.blocks;
}
ivec2 first_of_16() {
    return ivec2(8, 6) * uniforms.blocks;
}

// Distances along a line, cells: five bits each.
const int kDistances = 6;
const uint kDistance = 1u | 2u << 5 | 3u << 10 | 5u << 15 | 9u << 20 | 16u << 25;

int distance_of(int i) {
    return int(kDistance >> (5 * min(i, kDistances - 1)) & 31u);
}

// Horizontal, vertical and both diagonals.
ivec2 line_of(int line) {
    return ivec2(line == 1 ? 0 : 1, line == 0 ? 0 : (line == 3 ? -1 : 1));
}

// A line and the numbers of the distances on both its sides: eight bits.
uint pack_line(int line, int i, int j) {
    return uint(line << 6 | i << 3 | j);
}

// The cells on both sides.
uvec2 sides_on(uint line, ivec2 cell) {
    const ivec2 way = line_of(int(line >> 6 & 3u)), last = 8 * uniforms.blocks - 1;
    const ivec2 one = cell + distance_of(int(line >> 3 & 7u)) * way,
                other = cell - distance_of(int(line & 7u)) * way;
    return uvec2(pack_cell(clamp(one, ivec2(0), last)), pack_cell(clamp(other, ivec2(0), last)));
}

// A texel of `background`: x: inverse depth, y: the part of the cell that shows it. In a cell of 2 px
// it is a multiple of 1/16, and a line is kept as multiples of 2, which loses no bit of it.
float with_line(float part, uint line) {
    precise const float both = part + 2.0 * float(line + 1u);
    return both;
}
uint lines_of(float texel) {
    return uint(0.5 * texel);
}
float part_of(float texel) {
    precise const float part = texel - 2.0 * float(lines_of(texel));
    return part;
}
// A cell of 2 px; kNoCell if there are none.
uvec2 sides_of(float texel, ivec2 cell) {
    const uint lines = lines_of(texel);
    return lines == 0u ? uvec2(kNoCell) : sides_on(lines - 1u, cell);
}
