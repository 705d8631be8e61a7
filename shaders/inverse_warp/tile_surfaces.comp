#version 450 core
// For each tile of kBlockPx x kBlockPx pixels the three surfaces that are displaced most differently:
// the one displaced most, the one farthest from it, the one farthest from both; of equals the first in
// row order. One thread for a tile: on a software renderer a group with shared memory took ten
// times as long.
//
//   surfaces -> tile_surfaces   3 tiles.x by tiles.y
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform uimage2D tile_surfaces;

void main() {
    const ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, uniforms.tiles))) return;
    const ivec2 first = kBlockPx * tile;
    const ivec2 end = min(first + kBlockPx, uniforms.size);
    Surface chosen[2];
    for (int k = 0; k < 3; ++k) {
        float most = -1.0;
        uvec4 best = uvec4(0u);
        for (int y = first.y; y < end.y; ++y) {
            for (int x = first.x; x < end.x; ++x) {
                const uvec4 bits = texelFetch(surfaces, ivec2(x, y), 0);
                const Surface s = unpack_surface(bits);
                float least = displaced(s);
                if (k > 0) least = apart(s, chosen[0]);
                if (k > 1) least = min(least, apart(s, chosen[1]));
                if (least > most * kAlike) {
                    most = least;
                    best = bits;
                }
            }
        }
        imageStore(tile_surfaces, ivec2(3 * tile.x + k, tile.y), best);
        if (k < 2) chosen[k] = unpack_surface(best);
    }
}
