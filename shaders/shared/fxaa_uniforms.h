// Uniform block of FXAA (shaders/fxaa/, passes/fxaa/fxaa.cpp).
#ifndef POSTCHAIN_SHARED_FXAA_UNIFORMS_H
#define POSTCHAIN_SHARED_FXAA_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(FxaaUniforms)
    ivec2 size;                // of the planes, pixels
    float exposure;            // factor 2^exposure_ev
    float subpix;              // strength of the sub-pixel offset, 0..1
    float edge_threshold;      // of the local maximum
    float edge_threshold_min;  // absolute
    int walk_length;           // entries of walk that hold
    int hint_gate;             // 0 = tile gate, 1 = pixel gate
    vec4 luma_weights;         // r, g, b; w unused
    ivec4 walk[3];             // distances along the edge from the pixel, in half texels, rising
UNIFORMS_END

#ifdef __cplusplus
#include <cstddef>
namespace postchain::shared {
static_assert(sizeof(FxaaUniforms) == 96);
static_assert(offsetof(FxaaUniforms, edge_threshold) == 16);
static_assert(offsetof(FxaaUniforms, luma_weights) == 32);
static_assert(offsetof(FxaaUniforms, walk) == 48);
}  // namespace postchain::shared
#endif

#endif
