// Uniform block with lens samples (passes/common/lens_samples.h).
#ifndef POSTCHAIN_SHARED_LENS_SAMPLES_UNIFORMS_H
#define POSTCHAIN_SHARED_LENS_SAMPLES_UNIFORMS_H

#include "shared/uniforms.h"

// So that the block has the 16 KiB that every device allows.
#define LENS_SAMPLES_MAX 4092

UNIFORMS_BEGIN(LensSamplesUniforms)
    int points;  // of a set
    int sets;
    int pad0;
    int pad1;
    ivec4 packed_points[LENS_SAMPLES_MAX / 4];  // set after set; x in the lower half of each int, y
                                                // in the upper, in steps of 1/32767
UNIFORMS_END

#ifdef __cplusplus
#include <cstddef>
static_assert(sizeof(postchain::shared::LensSamplesUniforms) == 16384);
static_assert(offsetof(postchain::shared::LensSamplesUniforms, packed_points) == 16);
#endif

#endif
