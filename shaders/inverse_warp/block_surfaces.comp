#version 450 core
// For each block the three surfaces that are displaced most differently: the one displaced most,
// the one farthest from it, and the one farthest from both; on a tie, the first in row order wins.
// One thread per block: on a software renderer a group with shared memory took ten times as long.
//
//   surfaces -> block_surfaces   GIVEN blocks.x by blocks.y
//
// GIVEN: texels of a block; hidden_surfaces.comp writes those from the fourth on
// SECOND_LAYER: defined if the frame has a layer behind. Its surface that is displaced most differently
// from all three is a block's last texel.
#include "common/software_loop.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

#include "inverse_warp/hidden.glsl"

layout(binding = 0) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform uimage2D block_surfaces;

void store(ivec2 block, int k, uvec4 bits) {
    imageStore(block_surfaces, ivec2(GIVEN * block.x + k, block.y), without_flags(bits));
}

#ifdef SECOND_LAYER
void store_hidden(ivec2 block, ivec2 first, ivec2 end, Surface shown[3]) {
    float max_apart = 0.0;
    uvec4 best = pack_surface(shown[0]);  // no other one
    ivec2 p = first;
    SOFTWARE_LOOP do {
        const uvec4 bits = texelFetch(surfaces, p + second_half(), 0);
        const Surface s = unpack_surface(bits);
        const float apart_px2 = s.inverse_depth < 0.0 || s.edge ? 0.0 : apart_from(shown, s);
        if (apart_px2 > max_apart * kEqual) {
            max_apart = apart_px2;
            best = bits;
        }
        p = p.x + 1 < end.x ? p + ivec2(1, 0) : ivec2(first.x, p.y + 1);
    } while (p.y < end.y);
    store(block, GIVEN - 1, best);
}
#endif

void main() {
    const ivec2 block = invocation_at();
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    const ivec2 first = kBlockPx * block;
    const ivec2 end = min(first + kBlockPx, uniforms.size);
    Surface chosen[3];
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
        store(block, k, best);
        chosen[k] = unpack_surface(best);
    }
#ifdef SECOND_LAYER
    store_hidden(block, first, end, chosen);
#endif
}
