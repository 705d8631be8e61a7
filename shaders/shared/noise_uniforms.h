// Uniform block of the table of random numbers.
#ifndef POSTCHAIN_SHARED_NOISE_UNIFORMS_H
#define POSTCHAIN_SHARED_NOISE_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(NoiseUniforms)
    ivec2 shift;  // of the pattern, pixels, 0..127
    int pad0;
    int pad1;
    ivec4 ranks[512];  // blue noise only: ranks 0..4095 of 64 x 64 pixels, row-major, two in an
                       // int, the first in the lower half
UNIFORMS_END

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::NoiseUniforms) == 16 + 8192);
static_assert(offsetof(postchain::shared::NoiseUniforms, ranks) == 16);
#endif

#endif
