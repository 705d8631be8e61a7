#version 450 core
// What a pass filters beside color where objects are held out of it (docs/layers.md).
//
//   color, mattes [, layers] -> held: color without the object; what part of the pixel is not the
//                               object, in x; the frame's own layers without it
//
// MATTE: index of the pass's matte    OWN_LAYERS: how many layers the frame has
#include "common/matte.glsl"
#include "common/work_group.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2DArray mattes;
#if OWN_LAYERS
layout(binding = 2) uniform sampler2DArray layers;
#endif
layout(binding = 0) writeonly uniform image2DArray held;

void main() {
    const ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, textureSize(color, 0)))) return;
    const float kept = 1.0 - matte_at(p);
    imageStore(held, ivec3(p, 0), without(texelFetch(color, p, 0), kept));
    imageStore(held, ivec3(p, 1), vec4(kept, 0.0, 0.0, 0.0));
#if OWN_LAYERS
    for (int i = 0; i < OWN_LAYERS; ++i)
        imageStore(held, ivec3(p, i + 2), without(texelFetch(layers, ivec3(p, i), 0), kept));
#endif
}
