// Two cells of 2 px in a texel of `background`.

const uint kNoCell = 0xffffffffu;

uint pack_cell(ivec2 cell) {
    return uint(cell.x) | (uint(cell.y) << 16);
}

ivec2 unpack_cell(uint bits) {
    return ivec2(bits & 0xffffu, bits >> 16);
}
