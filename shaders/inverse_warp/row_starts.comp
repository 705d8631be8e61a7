#version 450 core
// Chooses, for each block, surfaces of the blocks in its row from which a search may start (start_choice.glsl).
// starts.comp then chooses along columns: the work grows with the reach, not with its square.
//
//   block_surfaces -> row_starts   STARTS blocks.x by blocks.y
const int kAxis = 0;
#include "inverse_warp/start_choice.glsl"

layout(binding = 0) writeonly uniform uimage2D row_starts;

// Room that is left repeats the first.
void main() {
    const ivec2 reaching = find_reaching();
    const ivec2 block = invocation_at() / ivec2(kSharers, 1);
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    const Starts chosen = choose_all(block, reaching);
    for (int i = 0; i < STARTS; ++i) {
        if (!is_mine(i)) continue;
        const ivec2 texel = i < chosen.count ? chosen.texel[i] : chosen.texel[0];
        imageStore(row_starts, ivec2(STARTS * block.x + i, block.y), texelFetch(given, texel, 0));
    }
}
