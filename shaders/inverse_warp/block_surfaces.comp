#version 450 core
// For each block the three surfaces that are displaced most differently: the one displaced most,
// the one farthest from it, and the one farthest from both; on a tie, the first in row order wins.
// One thread per block: on a software renderer a group with shared memory took ten times as long.
//
//   surfaces -> block_surfaces   3 blocks.x by blocks.y
#include "common/software_loop.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform uimage2D block_surfaces;

void main() {
    const ivec2 block = invocation_at();
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    const ivec2 first = kBlockPx * block;
    const ivec2 end = min(first + kBlockPx, uniforms.size);
    Surface chosen[2];
    for (int k = 0; k < 3; ++k) {
        float max_apart = -1.0;
        uvec4 best = uvec4(0u);
        // Four pixels of a row at a time, its last one again beyond the frame: a loop costs a software
        // renderer as much as their comparison.
        ivec2 row = first;
        SOFTWARE_LOOP do {
            for (int i = 0; i < 4; ++i) {
                const uvec4 bits =
                    texelFetch(surfaces, ivec2(min(row.x + i, end.x - 1), row.y), 0);
                const Surface s = unpack_surface(bits);
                float apart_px2 = displaced(s);
                if (k > 0) apart_px2 = apart(s, chosen[0]);
                if (k > 1) apart_px2 = min(apart_px2, apart(s, chosen[1]));
                if (apart_px2 > max_apart * kEqual) {
                    max_apart = apart_px2;
                    best = bits;
                }
            }
            row.x += 4;
            if (row.x >= end.x) row = ivec2(first.x, row.y + 1);
        } while (row.y < end.y);
        imageStore(block_surfaces, ivec2(3 * block.x + k, block.y), best);
        if (k < 2) chosen[k] = unpack_surface(best);
    }
}
