#version 450 core
// For each block of a neighbor, the surface that this frame hides and that is displaced most differently
// from those that this frame shows at its place. It becomes a candidate for start surfaces (starts.comp).
//
//   surfaces and marks of the neighbor, block_surfaces -> block_surfaces   texel 3 or 4 of the block
//
// GIVEN: texels of a block in block_surfaces
#include "common/software_loop.glsl"
#include "common/work_group.glsl"

#include "inverse_warp/surface.glsl"

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

void main() {
    const ivec2 block = invocation_at();
    if (any(greaterThanEqual(block, uniforms.blocks))) return;
    uint squares = 0u;  // a bit for each that has hidden pixels
    for (int i = 0; i < kSquaresAcross * kSquaresAcross; ++i)
        squares |= hidden_in(square_in(block, i)) != 0u ? 1u << i : 0u;
    // Otherwise a surface of the block itself: no other one.
    uvec4 best = texelFetch(given, ivec2(GIVEN * block.x, block.y), 0);
    float most_px2 = 0.0;
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
        const ivec2 p = kSquarePx * square + ivec2(number & 3, number >> 2);
        const Surface s = unpack_surface(texelFetch(surfaces_of_neighbor, in_half(p), 0));
        // Neither a pixel that no search may find, nor one whose surface this frame refutes.
        if (s.inverse_depth < 0.0 || s.refuted || s.edge) continue;
        const Surface hidden = seen_from_here(s);
        const ivec2 there = block_here(hidden, p);
        Surface shown[3];
        for (int k = 0; k < 3; ++k) shown[k] = given_surface(there, k);
        const float px2 = apart_from(shown, hidden);
        if (px2 > most_px2 * kEqual) {
            most_px2 = px2;
            best = pack_surface(hidden);
        }
    }
    imageStore(block_surfaces, ivec2(GIVEN * block.x + 3 + uniforms.second_half, block.y), best);
}
