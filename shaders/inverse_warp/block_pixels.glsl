// The pixels of a block, shared out among a work group that chooses one of them: the largest key, then the
// lowest index. GPUs only; a software renderer has an invocation for each block.
#include "shared/work_group.h"

const int kThreads = 64;
layout(local_size_x = kThreads) in;

#include "common/first_group.glsl"

const int kPixels = kBlockPx * kBlockPx;  // their indices are below this
const int kOfThread = kPixels / kThreads;

// Pixel i of this invocation.
int index_of(int i) {
    return int(gl_LocalInvocationIndex) + kThreads * i;
}

// Ranks order by key and index; 0: none.
uint rank_of(int key, int index) {
    return uint(key * kPixels + kPixels - 1 - index);
}
