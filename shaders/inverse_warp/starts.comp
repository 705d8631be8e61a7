#version 450 core
// For each tile the surfaces from which a search starts beside the pixel's own: of the tiles around
// those whose paths meet this tile, up to STARTS that move most differently, nearest first. One
// thread for a tile.
//
//   tile_surfaces -> starts   (STARTS + 1) tiles.x by tiles.y; the last texel of a tile: x bits of
//                             the longest path that meets the tile, px; y how many starts there are
//                 -> work lists of blocks: still, moving (LISTS)
#define LIST 0
#include "common/work_list.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D tile_surfaces;
layout(binding = 0) writeonly uniform uimage2D starts;
#if LISTS
layout(std430, binding = 0) buffer MovingBlocks { WORK_LIST } moving_blocks;
layout(std430, binding = 1) buffer StillBlocks { WORK_LIST } still_blocks;
#endif

const float kAlikePx = 1.0;  // surfaces less apart than this are one start

// Can a surface of the tile at this offset (in tiles) be displaced into this tile? Paths run along
// +-a, and aside by what b bends. A tenth more for what differs within its tile.
bool meets(Surface s, ivec2 offset) {
    vec2 reach = vec2(1.0);
#if SHUTTER
    reach += abs(s.a) + abs(s.b) + 0.1 * length(s.a);
#endif
#if LENS
    reach += 1.1 * abs(s.radius);
#endif
    const vec2 gap = vec2(max(abs(offset) - 1, ivec2(0)) * kBlockPx);
    return all(greaterThanEqual(reach, gap));
}

void main() {
    const ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, uniforms.tiles))) return;
    uvec4 chosen[STARTS];
    int count = 0;
    float longest = 0.0;
    // Each time the surface that is displaced most differently from those chosen before.
    for (int i = 0; i < STARTS; ++i) {
        float most = kAlikePx * kAlikePx;
        uvec4 next = uvec4(0u);
        bool found = false;
        for (int y = -uniforms.ring; y <= uniforms.ring; ++y) {
            for (int x = -uniforms.ring; x <= uniforms.ring; ++x) {
                const ivec2 at = tile + ivec2(x, y);
                if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, uniforms.tiles))) continue;
                for (int k = 0; k < 3; ++k) {
                    const uvec4 bits =
                        texelFetch(tile_surfaces, ivec2(3 * at.x + k, at.y), 0);
                    const Surface s = unpack_surface(bits);
                    if (!meets(s, ivec2(x, y))) continue;
                    float least = 3.0e38;
                    if (i == 0) {
                        longest = max(longest, longest_of(s));
                        least = displaced(s) + 2.0 * kAlikePx * kAlikePx;
                    }
                    for (int j = 0; j < i; ++j)
                        least = min(least, apart(s, unpack_surface(chosen[j])));
                    if (least > most * kAlike) {
                        most = least;
                        next = bits;
                        found = true;
                    }
                }
            }
        }
        if (!found) break;
        chosen[i] = next;
        count = i + 1;
    }
    const int row = (STARTS + 1) * tile.x;
    // Nearest first; of equals the one chosen first.
    uint taken = 0u;
    for (int i = 0; i < count; ++i) {
        int at = -1;
        for (int j = 0; j < count; ++j) {
            if ((taken & (1u << j)) != 0u) continue;
            if (at < 0 || unpack_surface(chosen[j]).inverse_depth >
                              unpack_surface(chosen[at]).inverse_depth)
                at = j;
        }
        taken |= 1u << at;
        imageStore(starts, ivec2(row + i, tile.y), chosen[at]);
    }
    imageStore(starts, ivec2(row + STARTS, tile.y),
               uvec4(floatBitsToUint(longest), uint(count), 0u, 0u));
#if LISTS
    if (longest <= uniforms.still_limit_px)
        ADD_TO_WORK_LIST(still_blocks, tile)
    else
        ADD_TO_WORK_LIST(moving_blocks, tile)
#endif
}
