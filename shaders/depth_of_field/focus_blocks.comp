#version 450 core
// Sorts the blocks of 16 x 16 pixels by their circles of confusion. One thread for a block.
//
//   row_range -> work lists
//             -> blurs          1 where the block needs the blurred image
//
//   sharp     every |R| is at most 0.5 px: colors return bit for bit
//   blurred   every |R| is at least full_blur_px: only the blurred image shows
//   mixed     all others
#include "common/work_list.glsl"
#include "shared/depth_of_field_block.h"

layout(binding = 0) uniform sampler2D row_range;
layout(binding = 0) writeonly uniform image2D blurs;
layout(std430, binding = 0) buffer SharpBlocks { WORK_LIST } sharp_blocks;
layout(std430, binding = 1) buffer BlurredBlocks { WORK_LIST } blurred_blocks;
layout(std430, binding = 2) buffer MixedBlocks { WORK_LIST } mixed_blocks;

// HALF_RADIUS: coc is stored as a half, by up to 2^-10 of itself smaller than computed.
#ifdef HALF_RADIUS
const float kStored = 1.0 - 1.0 / 1024.0;
#else
const float kStored = 1.0;
#endif

void main() {
    const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(kBlockPx * at, block.size))) return;
    const int end = min(kBlockPx * (at.y + 1), block.size.y);
    vec2 range = texelFetch(row_range, ivec2(at.x, kBlockPx * at.y), 0).xy;
    for (int y = kBlockPx * at.y + 1; y < end; ++y) {
        const vec2 row = texelFetch(row_range, ivec2(at.x, y), 0).xy;
        range = vec2(min(range.x, row.x), max(range.y, row.y));
    }
    const bool sharp = range.y <= 0.5;
    imageStore(blurs, at, vec4(sharp ? 0.0 : 1.0));
    if (sharp) {
        ADD_TO_WORK_LIST(sharp_blocks, at);
    } else if (range.x * kStored >= block.full_blur_px) {
        ADD_TO_WORK_LIST(blurred_blocks, at);
    } else {
        ADD_TO_WORK_LIST(mixed_blocks, at);
    }
}
