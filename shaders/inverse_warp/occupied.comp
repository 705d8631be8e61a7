#version 450 core
// Finds the extra layers that are not 0 in a block, or in a pixel next to it, which a bilinear tap in
// the block reads too. A work group finds the bits of one word (layer_bits.glsl) of one block; z:
// the words of this frame, then those of the frames before and after.
//
//   layers of the three frames -> occupied   blocks.x by blocks.y
//
// BEFORE, AFTER: that frame is searched
#include "common/work_group.glsl"

#include "inverse_warp/layer_bits.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2DArray layers;
#if BEFORE
layout(binding = 1) uniform sampler2DArray layers_before;
#endif
#if AFTER
layout(binding = 2) uniform sampler2DArray layers_after;
#endif
layout(binding = 0) writeonly uniform uimage2DArray occupied;

shared uint bits;

vec4 texel(int place, ivec3 at) {
#if BEFORE
    if (place == 1) return texelFetch(layers_before, at, 0);
#endif
#if AFTER
    if (place == 1 + BEFORE) return texelFetch(layers_after, at, 0);
#endif
    return texelFetch(layers, at, 0);
}

void main() {
    const int z = int(gl_WorkGroupID.z), words = words_of(layers);
    const int place = z / words, word = z % words;
    const ivec2 block = group_at();
    const ivec2 first = max(kBlockPx * block - 1, ivec2(0));
    const ivec2 end = min(kBlockPx * (block + 1) + 1, uniforms.size);
    if (gl_LocalInvocationIndex == 0u) bits = 0u;
    barrier();
    uint own = 0u, left = bits_of_word(layers, word);
    while (left != 0u) {
        const int layer = next_layer(left, word);
        for (int y = first.y + int(gl_LocalInvocationID.y); y < end.y; y += kBlockPx)
            for (int x = first.x + int(gl_LocalInvocationID.x); x < end.x; x += kBlockPx)
                if (any(notEqual(texel(place, ivec3(x, y, layer)), vec4(0.0))))
                    own |= 1u << (layer & 31);
    }
    atomicOr(bits, own);
    barrier();
    if (gl_LocalInvocationIndex == 0u) imageStore(occupied, ivec3(block, z), uvec4(bits));
}
