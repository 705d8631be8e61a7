// Uniform block of a step that needs the frame's size and nothing else. The planner fills it
// (chain/pass/planner.cpp), not the pass.
#ifndef POSTCHAIN_SHARED_FRAME_UNIFORMS_H
#define POSTCHAIN_SHARED_FRAME_UNIFORMS_H

#include "shared/uniforms.h"

UNIFORMS_BEGIN(FrameUniforms)
ivec2 size;  // of the frame
int pad0;
int pad1;
UNIFORMS_END

#ifdef __cplusplus
static_assert(sizeof(postchain::shared::FrameUniforms) == 16);
#endif

#endif
