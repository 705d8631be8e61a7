#version 450 core
// For each block of a neighbor, the surface that this frame hides and that is displaced most differently
// from those that this frame shows at its place; on a tie, the first one wins, square by square. It becomes
// a candidate for start surfaces (starts.comp). A GPU has a work group for each block, a software renderer
// an invocation.
//
//   surfaces and marks of the neighbor, block_surfaces -> block_surfaces   texel 3 or 4 of the block
//
// GIVEN: texels of a block in block_surfaces
#include "inverse_warp/surface.glsl"

#ifdef SOFTWARE_RENDERER
#include "common/work_group.glsl"
#else
#include "inverse_warp/block_pixels.glsl"
#endif

#include "inverse_warp/half.glsl"
#include "inverse_warp/hidden.glsl"

layout(binding = 0) uniform usampler2D surfaces_of_neighbor;
layout(binding = 1) uniform usampler2D marks;
layout(binding = 2) uniform usampler2D given;
layout(binding = 0) writeonly uniform uimage2D block_surfaces;

const int kSquarePx = INVERSE_WARP_SQUARE_PX;
const int kSquaresAcross = kBlockPx / kSquarePx;  // of a block

ivec2 square_in(ivec2 block, int i) {
    return kSquaresAcross * block + ivec2(i % kSquaresAcross, i / kSquaresAcross);
}

// The pixels of a square that this frame hides, away from depth edges.
uint hidden_in(ivec2 square) {
    if (any(greaterThan(square, (uniforms.size - 1) / kSquarePx))) return 0u;
    const uint bits = texelFetch(marks, square, 0).x;
    return bits >> 16 & ~bits;
}

Surface given_surface(ivec2 block, int k) {
    return unpack_surface(texelFetch(given, ivec2(GIVEN * block.x + k, block.y), 0));
}

// Surface s of the neighbor as this frame may hide it: it moves straight, as it does between the two
// frames. The flags say which neighbor shows it.
Surface seen_from_here(Surface s) {
    precise const vec2 a = s.a - float(uniforms.neighbor) * s.b;
    return Surface(s.inverse_depth, uniforms.neighbor < 0, uniforms.neighbor > 0, a, vec2(0.0), 0.0,
                   s.radius);
}

// The block of this frame in which surface s is, seen at pixel p of the neighbor.
ivec2 block_here(Surface s, ivec2 p) {
    precise const vec2 moved_px = s.a * (float(uniforms.neighbor) / uniforms.half_shutter);
    precise const vec2 at = vec2(p) - floor(moved_px + 0.5);
    return ivec2(clamp(at, vec2(0.0), vec2(uniforms.size - 1))) / kBlockPx;
}

// The surface that pixel `number` of a square shows, as this frame may hide it. Its key; 0 if this frame
// hides none.
int find_hidden(ivec2 square, int number, out Surface hidden) {
    const ivec2 p = kSquarePx * square + ivec2(number & 3, number >> 2);
    const uvec4 bits = texelFetch(surfaces_of_neighbor, in_half(p), 0);
    const Surface s = unpack_neighbor(bits);
    hidden = seen_from_here(s);
    // Neither a pixel that no search may find, nor one whose surface this frame refutes.
    if (is_in_other_light(bits) || s.inverse_depth < 0.0 || s.refuted || s.edge) return 0;
    const ivec2 there = block_here(hidden, p);
    Surface shown[3];
    for (int k = 0; k < 3; ++k) shown[k] = given_surface(there, k);
    return key_of(apart_from(shown, hidden));
}

// A surface of the block itself, if there is no other one.
uvec4 own_surface(ivec2 block) {
    return texelFetch(given, ivec2(GIVEN * block.x, block.y), 0);
}

void store(ivec2 block, uvec4 bits) {
    imageStore(block_surfaces, ivec2(GIVEN * block.x + 3 + uniforms.second_half, block.y), bits);
}

#ifdef SOFTWARE_RENDERER

void main() {
    const ivec2 block = invocation_at();
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    uint squares = 0u;  // a bit for each that has hidden pixels
    for (int i = 0; i < kSquaresAcross * kSquaresAcross; ++i)
        squares |= hidden_in(square_in(block, i)) != 0u ? 1u << i : 0u;
    uvec4 best = own_surface(block);
    int largest = 0;
    uint bits = 0u;
    ivec2 square = ivec2(0);
    while ((squares | bits) != 0u) {
        if (bits == 0u) {
            square = square_in(block, findLSB(squares));
            squares &= squares - 1u;
            bits = hidden_in(square);
        }
        const int number = findLSB(bits);
        bits &= bits - 1u;
        Surface hidden;
        const int key = find_hidden(square, number, hidden);
        if (key > largest) {
            largest = key;
            best = pack_surface(hidden);
        }
    }
    store(block, best);
}

#else

shared uint largest_rank;

// Indices of pixels count the squares one after another.
void main() {
    const ivec2 block = group_at();
    if (gl_LocalInvocationIndex == 0u) largest_rank = 0u;
    barrier();
    uint largest = 0u;
    uvec4 best = uvec4(0u);
    for (int i = 0; i < kOfThread; ++i) {
        const int number = index_of(i) % (kSquarePx * kSquarePx);
        const ivec2 square = square_in(block, index_of(i) / (kSquarePx * kSquarePx));
        if ((hidden_in(square) >> number & 1u) == 0u) continue;
        Surface hidden;
        const int key = find_hidden(square, number, hidden);
        const uint rank = rank_of(key, index_of(i));
        if (key == 0 || rank <= largest) continue;
        largest = rank;
        best = pack_surface(hidden);
    }
    if (largest != 0u) atomicMax(largest_rank, largest);
    barrier();
    if (largest_rank != 0u ? largest == largest_rank : gl_LocalInvocationIndex == 0u)
        store(block, largest_rank != 0u ? best : own_surface(block));
}
#endif
