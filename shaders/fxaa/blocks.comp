#version 450 core
// FXAA, stage "blocks": sorts the blocks by whether one of their pixels has a hint. A work group sorts
// 4 x 4 blocks, with an invocation for each row of a block.
//
//   hint -> work lists
#include "common/work_list.glsl"
#include "shared/fxaa_uniforms.h"
#include "fxaa/gate.glsl"

layout(std430, binding = 0) buffer FilteredBlocks { WORK_LIST } filtered_blocks;
layout(std430, binding = 1) buffer KeptBlocks { WORK_LIST } kept_blocks;

const int kEdge = 4;  // blocks of a work group along an axis; kEdge * kEdge == kBlockPx
shared uint hinted[kEdge * kEdge];

bool has_hint(ivec2 first) {
    if (first.y >= uniforms.size.y) return false;
    float sum = 0.0;
    for (int x = first.x; x < min(first.x + kBlockPx, uniforms.size.x); ++x)
        sum += hint_at(ivec2(x, first.y));
    return sum > 0.0;
}

void main() {
    const int index = int(gl_LocalInvocationIndex);
    if (index < kEdge * kEdge) hinted[index] = 0u;
    barrier();
    const ivec2 id = ivec2(gl_LocalInvocationID.xy);
    const ivec2 in_group = id / kEdge, block = kEdge * group_at() + in_group;
    const int row = kEdge * (id.y % kEdge) + id.x % kEdge, place = kEdge * in_group.y + in_group.x;
    if (has_hint(kBlockPx * block + ivec2(0, row))) atomicOr(hinted[place], 1u);
    barrier();
    if (row != 0 || any(greaterThanEqual(kBlockPx * block, uniforms.size))) return;
    if (hinted[place] != 0u) ADD_TO_WORK_LIST(filtered_blocks, block)
    else ADD_TO_WORK_LIST(kept_blocks, block)
}
