#version 450 core
// For each block its start surfaces, from which a search starts after the pixel's own: of the
// blocks around, the surfaces whose paths reach this block, up to STARTS that move most
// differently, nearest first. One thread per block.
//
//   block_surfaces -> starts   (STARTS + 1) blocks.x by blocks.y; the last texel of a block: x bits
//                              of the longest path that reaches it, px; y number of start surfaces
//                  -> work lists of blocks: still, moving (LISTS)
#include "shared/inverse_warp_uniforms.h"
#include "shared/work_group.h"

const int kThreads = INVERSE_WARP_STARTS_BLOCKS * INVERSE_WARP_STARTS_BLOCKS;
layout(local_size_x = INVERSE_WARP_STARTS_BLOCKS, local_size_y = INVERSE_WARP_STARTS_BLOCKS) in;

#include "common/first_group.glsl"
#include "common/work_list_fill.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D block_surfaces;
layout(binding = 0) writeonly uniform uimage2D starts;
#if LISTS
layout(std430, binding = 0) buffer MovingBlocks { WORK_LIST } moving_blocks;
layout(std430, binding = 1) buffer StillBlocks { WORK_LIST } still_blocks;
#endif

const float kAlikePx = 1.0;  // surfaces less apart than this are one start surface

// Start surfaces in the order in which they are chosen.
struct Starts {
    uvec4 bits[STARTS];
    int count;
    float longest_px;  // longest path that reaches the block
};

// How far the surfaces of a block can be displaced along x and y, px. Paths run along +-a, and b
// bends them aside. Surfaces within a block may differ by a tenth.
vec2 reach_of(Surface s) {
    precise vec2 reach = vec2(1.0);
    if (kShutter) reach += abs(s.a) + abs(s.b) + 0.1 * precise_length(s.a);
    if (kLens) reach += 1.1 * abs(s.radius);
    return reach;
}

// Can a surface of the block at this offset (in blocks) be displaced into this block?
bool reaches(Surface s, ivec2 offset) {
    const vec2 gap = vec2(max(abs(offset) - 1, ivec2(0)) * kBlockPx);
    return all(greaterThanEqual(reach_of(s), gap));
}

// Longest reach of the three surfaces of a block, px.
float longest_of_block(ivec2 block) {
    float longest = 0.0;
    for (int k = 0; k < 3; ++k) {
        const uvec4 bits = texelFetch(block_surfaces, ivec2(3 * block.x + k, block.y), 0);
        const vec2 reach = reach_of(unpack_surface(bits));
        longest = max(longest, max(reach.x, reach.y));
    }
    return longest;
}

// Blocks on each side whose surfaces reach a block on this frame. uniforms.ring is an upper limit
// of it, by bounds that an engine's frame does not have.
shared uint longest_reach;  // bits, px
int find_ring() {
    if (gl_LocalInvocationIndex == 0u) longest_reach = 0u;
    barrier();
    const ivec2 blocks = uniforms.blocks;
    float longest = 0.0;
    for (int i = int(gl_LocalInvocationIndex); i < blocks.x * blocks.y; i += kThreads)
        longest = max(longest, longest_of_block(ivec2(i % blocks.x, i / blocks.x)));
    atomicMax(longest_reach, floatBitsToUint(longest));
    barrier();
    // A float beyond the integers' range is limited first.
    const float px = min(uintBitsToFloat(longest_reach), float(uniforms.ring * kBlockPx));
    return min(int(px) / kBlockPx + 1, uniforms.ring);
}

// The surface so far that is displaced most differently.
struct Farthest {
    uvec4 bits;
    float apart_px2;
    bool found;
};

// Surface k of block `at` as start surface i of `block`.
void consider(int k, int i, ivec2 at, ivec2 block, inout Farthest farthest, inout Starts chosen) {
    const uvec4 bits = texelFetch(block_surfaces, ivec2(3 * at.x + k, at.y), 0);
    const Surface s = unpack_surface(bits);
    if (!reaches(s, at - block)) return;
    precise float apart_px2 = 3.0e38;
    if (i == 0) {
        chosen.longest_px = max(chosen.longest_px, longest_of(s));
        apart_px2 = displaced(s) + 2.0 * kAlikePx * kAlikePx;
    }
    for (int j = 0; j < STARTS; ++j)
        if (j < i) apart_px2 = min(apart_px2, apart(s, unpack_surface(chosen.bits[j])));
    if (apart_px2 > farthest.apart_px2 * kEqual) farthest = Farthest(bits, apart_px2, true);
}

// Chooses, as start surface i, the one that is displaced most differently from those before. False
// if all are alike.
bool choose(int i, ivec2 block, int ring, inout Starts chosen) {
    Farthest farthest = Farthest(uvec4(0u), kAlikePx * kAlikePx, false);
    const ivec2 first = max(block - ring, ivec2(0));
    const ivec2 last = min(block + ring, uniforms.blocks - 1);
    // Tested at the end: a software renderer runs a body once more to find the test at its start.
    // Without inner loops: llvmpipe ends the loops of an invocation after 65535 iterations of all of
    // them together.
    ivec2 at = first;
    do {
        consider(0, i, at, block, farthest, chosen);
        consider(1, i, at, block, farthest, chosen);
        consider(2, i, at, block, farthest, chosen);
        at = at.x < last.x ? at + ivec2(1, 0) : ivec2(first.x, at.y + 1);
    } while (at.y <= last.y);
    if (!farthest.found) return false;
    chosen.bits[i] = farthest.bits;
    chosen.count = i + 1;
    return true;
}

// Stores them nearest first; on a tie, the one chosen first wins.
void store_sorted(Starts chosen, ivec2 first) {
    uint stored = 0u;
    for (int i = 0; i < chosen.count; ++i) {
        int at = -1;
        for (int j = 0; j < chosen.count; ++j) {
            if ((stored & (1u << j)) != 0u) continue;
            if (at < 0 || unpack_surface(chosen.bits[j]).inverse_depth >
                              unpack_surface(chosen.bits[at]).inverse_depth)
                at = j;
        }
        stored |= 1u << at;
        imageStore(starts, first + ivec2(i, 0), chosen.bits[at]);
    }
}

void main() {
    const int ring = find_ring();
    const ivec2 block = invocation_at();
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    Starts chosen;
    chosen.count = 0;
    chosen.longest_px = 0.0;
    bool found = true;
    for (int i = 0; found && i < STARTS; ++i) found = choose(i, block, ring, chosen);
    const ivec2 first = ivec2((STARTS + 1) * block.x, block.y);
    store_sorted(chosen, first);
    imageStore(starts, first + ivec2(STARTS, 0),
               uvec4(floatBitsToUint(chosen.longest_px), uint(chosen.count), 0u, 0u));
#if LISTS
    if (chosen.longest_px <= uniforms.still_limit_px)
        ADD_TO_WORK_LIST(still_blocks, block)
    else
        ADD_TO_WORK_LIST(moving_blocks, block)
#endif
}
