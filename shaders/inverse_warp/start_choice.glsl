// The choice of start surfaces along a line of blocks: those whose paths reach a block along the line, up to
// STARTS that are displaced most differently; on a tie, the first on the line wins. A GPU has a work group for
// each block, a software renderer an invocation. Before it: kAxis, 0: lines are rows, 1: columns.
//
// GIVEN: surfaces of each block in the texture that is read
// NEIGHBORS: some may be those of a neighbor's block, which this frame hides
#include "shared/inverse_warp_uniforms.h"
#include "shared/work_group.h"

// Blocks of a group along each axis, and invocations that share a block.
#ifdef SOFTWARE_RENDERER
const int kGroupEdge = INVERSE_WARP_STARTS_BLOCKS, kSharers = 1;
layout(local_size_x = kGroupEdge, local_size_y = kGroupEdge) in;
#else
const int kGroupEdge = 1, kSharers = 32;
layout(local_size_x = kSharers) in;
#endif
const int kThreads = kGroupEdge * kGroupEdge * kSharers;

#include "common/first_group.glsl"
#include "common/software_loop.glsl"

#include "inverse_warp/surface.glsl"

layout(binding = 0) uniform usampler2D given;


// Start surfaces in the order in which they are chosen.
struct Starts {
    Surface surface[STARTS];
    ivec2 texel[STARTS];  // where they are given
    int count;
    float longest_px;  // longest path that reaches the block
};

// A block of the line through `block`.
ivec2 on_line(ivec2 block, int place) {
    return kAxis == 0 ? ivec2(place, block.y) : ivec2(block.x, place);
}

ivec2 texel_of(ivec2 block, int k) {
    return ivec2(GIVEN * block.x + k, block.y);
}

Surface given_surface(ivec2 texel) {
    return unpack_surface(texelFetch(given, texel, 0));
}

// How far the surfaces of a block can be displaced along the line, px. Paths run along +-a, and b
// bends them aside. Surfaces within a block may differ by a tenth.
float reach_of(Surface s) {
    precise float reach = 1.0;
    if (kShutter) reach += abs(s.a[kAxis]) + abs(s.b[kAxis]) + 0.1 * precise_length(s.a);
    if (kLens) reach += 1.1 * abs(s.radius);
    return reach;
}

// Least distance along the line between pixels of two blocks that are so many blocks apart, px.
float gap_px(float blocks) {
    precise const float px = max(blocks - 1.0, 0.0) * float(kBlockPx);
    return px;
}

// Where surface s of a neighbor's block is at this frame's time, from there, in blocks along the line.
// The flags of a surface say whether it is a neighbor's (hidden_surfaces.comp).
float shift_of(Surface s) {
#if NEIGHBORS
    const float frame = s.edge ? -1.0 : s.refuted ? 1.0 : 0.0;
    precise const float shift = -frame * s.a[kAxis] * (1.0 / (float(kBlockPx) * uniforms.half_shutter));
    return shift;
#else
    return 0.0;
#endif
}

// First and last place on the lines of this work group's blocks from which a surface reaches one of
// these blocks. No invocation looks beyond them.
shared int first_reaching, last_reaching;
#ifndef SOFTWARE_RENDERER
shared uint longest_bits;            // of the longest path, px: bits of numbers from 0 on are in their order
shared uint largest_rank[STARTS];    // of the start surface that is chosen; 0: none
#endif
ivec2 find_reaching() {
    const ivec2 group = kGroupEdge * group_at();
    const int thread = int(gl_LocalInvocationIndex);
    if (thread == 0) {
        first_reaching = group[kAxis];
        last_reaching = group[kAxis];
    }
#ifndef SOFTWARE_RENDERER
    if (thread == 0) longest_bits = 0u;
    if (thread < STARTS) largest_rank[thread] = 0u;
#endif
    barrier();
    const ivec2 block = min(group + thread % kGroupEdge, uniforms.blocks - 1);
    for (int at = thread / kGroupEdge; at < uniforms.blocks[kAxis]; at += kThreads / kGroupEdge) {
        bool reaches = false;
        for (int k = 0; k < GIVEN; ++k) {
            const Surface s = given_surface(texel_of(on_line(block, at), k));
            precise const float from = float(at) + shift_of(s), before = float(group[kAxis]) - from,
                                behind = from - float(group[kAxis] + kGroupEdge - 1);
            reaches = reaches || reach_of(s) >= gap_px(max(before, behind));
        }
        if (!reaches) continue;
        atomicMin(first_reaching, at);
        atomicMax(last_reaching, at);
    }
    barrier();
    return ivec2(first_reaching, last_reaching);
}

// The surface so far that is displaced most differently: the largest key, and the first one with it.
struct Farthest {
    Surface surface;
    ivec2 texel;
    int key;
    int candidate;  // its number on the line
    bool found;
};

int least_key() {
    return key_of(kAlikePx * kAlikePx);
}

// Surface k of the block at this place on the line as start surface i of `block`. Of several, the one with
// the lowest place and then the lowest k comes first.
void consider(int k, int i, int place, ivec2 block, inout Farthest farthest, inout Starts chosen) {
    const ivec2 texel = texel_of(on_line(block, place), k);
    const Surface s = given_surface(texel);
    precise const float away = float(place) + shift_of(s) - float(block[kAxis]);
    if (reach_of(s) < gap_px(abs(away))) return;
    precise float apart_px2 = 3.0e38;
    if (i == 0) {
        chosen.longest_px = max(chosen.longest_px, longest_of(s));
        apart_px2 = displaced(s) + 2.0 * kAlikePx * kAlikePx;
    }
    for (int j = 0; j < STARTS; ++j)
        if (j < i) apart_px2 = min(apart_px2, apart(s, chosen.surface[j]));
    const int key = key_of(apart_px2);
    if (key > farthest.key) farthest = Farthest(s, texel, key, GIVEN * place + k, true);
}

#ifdef SOFTWARE_RENDERER
void consider_line(int i, ivec2 block, ivec2 reaching, inout Farthest farthest,
                   inout Starts chosen) {
    int place = reaching[0];
    SOFTWARE_LOOP do {
        // Two at a time: llvmpipe ends the loops of an invocation after 65535 iterations of all of them
        // together, and a line may have 1024 blocks.
        for (int k = 0; k < GIVEN; k += 2) {
            consider(k, i, place, block, farthest, chosen);
            if (k + 1 < GIVEN) consider(k + 1, i, place, block, farthest, chosen);
        }
    } while (++place <= reaching[1]);
}

bool is_mine(int i) {
    return true;
}
#else
// Each invocation considers a part of the line. Their choices are ranked by key, then by number:
//
//    31      15 14               0
//   +----------+------------------+
//   | key - l  | 32767 - number   |   l: least_key(); the line has at most 2048 blocks
//   +----------+------------------+
const int kNumberBits = 15, kLastNumber = (1 << kNumberBits) - 1;

void consider_line(int i, ivec2 block, ivec2 reaching, inout Farthest farthest,
                   inout Starts chosen) {
    const int end = GIVEN * (reaching[1] + 1);
    for (int n = GIVEN * reaching[0] + int(gl_LocalInvocationIndex); n < end; n += kThreads)
        consider(n % GIVEN, i, n / GIVEN, block, farthest, chosen);
    if (farthest.found)
        atomicMax(largest_rank[i], uint((farthest.key - least_key() << kNumberBits) |
                                        kLastNumber - farthest.candidate));
    if (i == 0) atomicMax(longest_bits, floatBitsToUint(chosen.longest_px));
    barrier();
    if (i == 0) chosen.longest_px = uintBitsToFloat(longest_bits);
    farthest.found = largest_rank[i] != 0u;
    const int candidate = kLastNumber - int(largest_rank[i] & uint(kLastNumber));
    farthest.texel = texel_of(on_line(block, candidate / GIVEN), candidate % GIVEN);
    farthest.surface = given_surface(farthest.texel);
}

// Each invocation stores some start surfaces.
bool is_mine(int i) {
    return i == int(gl_LocalInvocationIndex);
}
#endif

// Chooses, as start surface i, the one that is displaced most differently from those before. False
// if all are alike.
bool choose(int i, ivec2 block, ivec2 reaching, inout Starts chosen) {
    Farthest farthest = Farthest(not_there(), ivec2(0), least_key(), 0, false);
    consider_line(i, block, reaching, farthest, chosen);
    if (!farthest.found) return false;
    // By constant indices, which registers can have.
    for (int j = 0; j < STARTS; ++j) {
        if (j != i) continue;
        chosen.surface[j] = farthest.surface;
        chosen.texel[j] = farthest.texel;
    }
    chosen.count = i + 1;
    return true;
}

// Chooses the start surfaces of a block, which itself reaches it, so that at least one is chosen.
Starts choose_all(ivec2 block, ivec2 reaching) {
    Starts chosen;
    for (int i = 0; i < STARTS; ++i) {
        chosen.surface[i] = not_there();
        chosen.texel[i] = ivec2(0);
    }
    chosen.count = 0;
    chosen.longest_px = 0.0;
    bool found = true;
    for (int i = 0; found && i < STARTS; ++i) found = choose(i, block, reaching, chosen);
    return chosen;
}
