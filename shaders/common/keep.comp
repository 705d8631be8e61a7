#version 450 core
// Blocks that nothing moves into keep their color, bit for bit if it is finite.
//
//   color [, hint] -> color [, hint] [, soft]   in the blocks of the list
//
// LAYERS: number of extra layers HINT: 1: 0 is written; 2: it is copied    SOFT: 0 is written to it
#include "common/finite.glsl"
#include "common/layers.glsl"
#include "common/work_list.glsl"
#include "shared/frame_uniforms.h"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D kept;
#if HINT == 2
layout(binding = 1) uniform sampler2D given_hint;
#endif
#if HINT
layout(binding = 1) writeonly uniform image2D hint;
#endif
#if SOFT
layout(binding = 2) writeonly uniform image2D soft;
#endif
#ifdef LAYERS
layout(binding = 2) uniform sampler2DArray layers;
layout(binding = 3) writeonly uniform image2DArray layers_kept;
#endif

void main() {
    ivec2 p;
    if (!next_pixel(uniforms.size, p)) return;
    STORE(kept, p, finite_color(texelFetch(color, p, 0)));
#if HINT == 2
    STORE(hint, p, texelFetch(given_hint, p, 0));
#elif HINT
    STORE(hint, p, vec4(0.0));
#endif
#if SOFT
    STORE(soft, p, vec4(0.0));
#endif
#ifdef LAYERS
    FOR_LAYERS(i) LAYER_STORE(layers_kept, p, i, LAYER_FETCH(layers, p, i));
#endif
}
