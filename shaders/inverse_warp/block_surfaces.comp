#version 450 core
// For each block the three surfaces that are displaced most differently: the one displaced most,
// the one farthest from it, and the one farthest from both; on a tie, the first in row order wins.
// A GPU has a work group for each block. On a software renderer such a group, with its shared memory, took
// ten times as long as one invocation for each block.
//
//   surfaces -> block_surfaces   GIVEN blocks.x by blocks.y
//
// GIVEN: texels of a block; hidden_surfaces.comp writes those from the fourth on
// SECOND_LAYER: defined if the frame has a layer behind. Its surface that is displaced most differently
// from all three is a block's last texel.
#include "common/software_loop.glsl"

#include "inverse_warp/surface.glsl"

#include "inverse_warp/hidden.glsl"

#ifdef SOFTWARE_RENDERER
#include "common/work_group.glsl"
#else
#include "inverse_warp/block_pixels.glsl"
#endif

layout(binding = 0) uniform usampler2D surfaces;
layout(binding = 0) writeonly uniform uimage2D block_surfaces;

void store(ivec2 block, int k, uvec4 bits) {
    imageStore(block_surfaces, ivec2(GIVEN * block.x + k, block.y), without_flags(bits));
}

// The key of a surface as candidate for the block's surface k.
int key_as(int k, Surface s, Surface chosen[3]) {
    float apart_px2 = displaced(s);
    if (k > 0) apart_px2 = apart(s, chosen[0]);
    if (k > 1) apart_px2 = min(apart_px2, apart(s, chosen[1]));
    return key_of(apart_px2);
}

// The key of a surface of the layer behind; 0 if the pixel has no such surface.
int key_of_hidden(Surface s, Surface shown[3]) {
    const float apart_px2 = s.inverse_depth < 0.0 || s.edge ? 0.0 : apart_from(shown, s);
    return key_of(apart_px2);
}

#ifdef SOFTWARE_RENDERER

#ifdef SECOND_LAYER
void store_hidden(ivec2 block, ivec2 first, ivec2 end, Surface shown[3]) {
    int largest = 0;
    uvec4 best = pack_surface(shown[0]);  // no other one
    ivec2 p = first;
    SOFTWARE_LOOP do {
        const uvec4 bits = texelFetch(surfaces, p + second_half(), 0);
        const int key = key_of_hidden(unpack_surface(bits), shown);
        if (key > largest) {
            largest = key;
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
        int largest = -1;
        uvec4 best = uvec4(0u);
        // Four pixels of a row at a time, its last one again beyond the frame: a loop costs a software
        // renderer as much as their comparison.
        ivec2 row = first;
        SOFTWARE_LOOP do {
            for (int i = 0; i < 4; ++i) {
                const uvec4 bits =
                    texelFetch(surfaces, ivec2(min(row.x + i, end.x - 1), row.y), 0);
                const int key = key_as(k, unpack_surface(bits), chosen);
                if (key > largest) {
                    largest = key;
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

#else

shared uint largest_rank[4];  // the last one of the layer behind
shared uvec4 chosen_bits[3];

void main() {
    const ivec2 block = group_at(), first = kBlockPx * block;
    if (gl_LocalInvocationIndex < 4u) largest_rank[gl_LocalInvocationIndex] = 0u;
    bool is_pixel[kOfThread];
    ivec2 at[kOfThread];
    uvec4 bits[kOfThread];
    for (int i = 0; i < kOfThread; ++i) {
        at[i] = first + ivec2(index_of(i) % kBlockPx, index_of(i) / kBlockPx);
        is_pixel[i] = all(lessThan(at[i], uniforms.size));
        bits[i] = texelFetch(surfaces, min(at[i], uniforms.size - 1), 0);
    }
    barrier();
    Surface chosen[3];
    for (int k = 0; k < 3; ++k) {
        uint largest = 0u;
        uvec4 best = bits[0];
        for (int i = 0; i < kOfThread; ++i) {
            const uint rank = rank_of(key_as(k, unpack_surface(bits[i]), chosen), index_of(i));
            if (!is_pixel[i] || rank <= largest) continue;
            largest = rank;
            best = bits[i];
        }
        atomicMax(largest_rank[k], largest);
        barrier();
        // A pixel of its own has the rank; the block's first one has some rank.
        if (largest == largest_rank[k]) {
            chosen_bits[k] = best;
            store(block, k, best);
        }
        barrier();
        chosen[k] = unpack_surface(chosen_bits[k]);
    }
#ifdef SECOND_LAYER
    uint largest = 0u;
    uvec4 best = chosen_bits[0];  // no other one
    for (int i = 0; i < kOfThread; ++i) {
        const uvec4 behind = texelFetch(surfaces, min(at[i], uniforms.size - 1) + second_half(), 0);
        const int key = key_of_hidden(unpack_surface(behind), chosen);
        const uint rank = rank_of(key, index_of(i));
        if (!is_pixel[i] || key == 0 || rank <= largest) continue;
        largest = rank;
        best = behind;
    }
    atomicMax(largest_rank[3], largest);
    barrier();
    const bool is_found = largest_rank[3] != 0u;
    if (is_found ? largest == largest_rank[3] : gl_LocalInvocationIndex == 0u)
        store(block, GIVEN - 1, best);
#endif
}
#endif
